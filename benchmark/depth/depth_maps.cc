// depth_maps: depth maps of all photos of a COLMAP model, and how good they are.
//
//   depth_maps --model DIR --images DIR [--surfaces PLY] [--output DIR]
//   depth_maps --rgbd DIR [--output DIR]
//
// Prints one JSON object: the figures of the maps before and after the check by other maps, those
// of OpenCV's StereoSGBM on rectified pairs of the same photos, CPU seconds a photo. --output: a
// picture of each photo's map beside the photo.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <ctime>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "benchmark/depth/depth_losses.h"
#include "benchmark/depth/depth_truth.h"
#include "benchmark/depth/rgbd_scene.h"
#include "depth/model_depths.h"
#include "export/session_models.h"

namespace skein {
namespace {

using nlohmann::json;

struct Arguments {
  std::string model, images, surfaces, rgbd, output;
  RgbdRig rig;
  size_t most = 1000;
  bool sgbm = false, losses = false;
  int size_px = 800;
  InstructionSet kernel = FastestInstructionSet();
};

double CpuSeconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

DepthScene ReadModelScene(const std::string& folder) {
  const Result<ExportModel> model = ReadModelFolder(folder);
  if (!model) throw std::runtime_error(model.error());
  return DepthSceneOf(*model->reconstruction);
}

// The first photos by name.
DepthScene ReadDepthScene(const Arguments& arguments) {
  DepthScene scene = arguments.rgbd.empty() ? ReadModelScene(arguments.model)
                                            : ReadRgbdScene(arguments.rgbd, arguments.rig);
  const size_t count = std::min(arguments.most, scene.photos.size());
  scene.names.resize(count);
  scene.lenses.resize(count);
  scene.cameras.resize(count);
  scene.photos.resize(count);
  return scene;
}

DepthInput Prepare(const Arguments& arguments, const DepthScene& scene) {
  const auto photo = [&](size_t i) -> Result<cv::Mat3b> {
    return ReadPhoto(arguments.images + "/" + scene.names[i]);
  };
  return *ReadDepthInput(scene, arguments.size_px, photo);
}

DepthMap Holes(const DepthPhoto& photo) {
  return {photo.camera, photo.cam_from_world, cv::Mat1f(photo.grey.size(), 0.0f),
          cv::Mat1f(photo.grey.size(), 0.0f)};
}

std::vector<DepthMap> Sweep(const Arguments& arguments, const DepthInput& input, json* times) {
  DepthSweep sweep(arguments.kernel);
  std::vector<DepthMap> maps;
  DepthTimes sum;
  double steps = 0;
  for (size_t i = 0; i < input.photos.size(); ++i) {
    maps.push_back(SweepPhoto(input, i, &sweep));
    sum.warp += sweep.times().warp;
    sum.costs += sweep.times().costs;
    sum.paths += sweep.times().paths;
    sum.choice += sweep.times().choice;
    steps += sweep.steps();
  }
  const double n = static_cast<double>(maps.size());
  *times = {{"warp", sum.warp / n},     {"costs", sum.costs / n}, {"paths", sum.paths / n},
            {"choice", sum.choice / n}, {"sum", sum.Sum() / n},   {"steps", steps / n}};
  return maps;
}

std::vector<DepthMap> Agreed(const DepthInput& input, const std::vector<DepthMap>& maps,
                             json* times) {
  const double start = CpuSeconds();
  std::vector<DepthMap> agreed = CheckDepths(maps, input.Confirming()).maps;
  (*times)["agreement"] = (CpuSeconds() - start) / static_cast<double>(maps.size());
  return agreed;
}

// ---- OpenCV's StereoSGBM on the rectified pair of a photo and a neighbour ----

template <class M>
cv::Mat1d ToCv(const M& m) {
  cv::Mat1d out(static_cast<int>(m.rows()), static_cast<int>(m.cols()));
  for (int i = 0; i < out.rows; ++i) {
    for (int j = 0; j < out.cols; ++j) out(i, j) = m(i, j);
  }
  return out;
}

DepthMap StereoSgbm(const DepthPhoto& photo, const DepthPhoto& neighbour, const DepthRange& range) {
  DepthMap map = Holes(photo);
  const Eigen::Matrix3d r =
      neighbour.cam_from_world.rotation * photo.cam_from_world.rotation.transpose();
  const Eigen::Vector3d t =
      neighbour.cam_from_world.translation - r * photo.cam_from_world.translation;
  const cv::Mat1d k1 = ToCv(photo.camera.CalibrationOfIndices()),
                  k2 = ToCv(neighbour.camera.CalibrationOfIndices()), none;
  const cv::Size size = photo.grey.size();
  cv::Mat1d r1, r2, p1, p2;
  cv::Mat q;
  cv::stereoRectify(k1, none, k2, none, size, ToCv(r), ToCv(t), r1, r2, p1, p2, q,
                    cv::CALIB_ZERO_DISPARITY, 0, size);
  const bool is_vertical = std::abs(p2(1, 3)) > std::abs(p2(0, 3));
  const double focal_times_base = is_vertical ? p2(1, 3) : p2(0, 3);
  cv::Mat x1, y1, x2, y2;
  cv::initUndistortRectifyMap(k1, none, r1, p1, size, CV_32F, x1, y1);
  cv::initUndistortRectifyMap(k2, none, r2, p2, size, CV_32F, x2, y2);
  cv::Mat left, right;
  cv::remap(photo.grey, left, x1, y1, cv::INTER_LINEAR);
  cv::remap(neighbour.grey, right, x2, y2, cv::INTER_LINEAR);
  if (is_vertical) {
    left = left.t();
    right = right.t();
  }
  const double a = -focal_times_base / range.near, b = -focal_times_base / range.far;
  const int low = static_cast<int>(std::floor(std::min(a, b)));
  const int count = static_cast<int>(std::ceil(std::abs(a - b)) + 16) / 16 * 16;
  const auto matcher = cv::StereoSGBM::create(low, std::min(count, 256), 5, 8 * 25, 32 * 25, 1, 0,
                                              10, 100, 2, cv::StereoSGBM::MODE_HH);
  cv::Mat1s disparity;
  matcher->compute(left, right, disparity);
  if (is_vertical) disparity = disparity.t();
  // Rectified ray of each pixel of the photo.
  const cv::Matx33d rotation(r1);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const Eigen::Vector2d ray = photo.camera.Ray({x + 0.5, y + 0.5});
      const cv::Vec3d turned = rotation * cv::Vec3d(ray.x(), ray.y(), 1);
      const double u = p1(0, 0) * turned[0] / turned[2] + p1(0, 2);
      const double v = p1(1, 1) * turned[1] / turned[2] + p1(1, 2);
      const int column = static_cast<int>(std::lround(u)), row = static_cast<int>(std::lround(v));
      if (turned[2] <= 0 || column < 0 || row < 0 || column >= size.width || row >= size.height) {
        continue;
      }
      const int found = disparity(row, column);
      if (found < 16 * low || found == 0) continue;
      const double rectified_depth = -focal_times_base * 16 / found;
      if (rectified_depth <= 0) continue;
      map.depth(y, x) = static_cast<float>(rectified_depth / turned[2]);
      map.error(y, x) = 0.01f * map.depth(y, x);
    }
  }
  return map;
}

std::vector<DepthMap> SgbmMaps(const DepthInput& input, json* times) {
  const double start = CpuSeconds();
  std::vector<DepthMap> maps;
  for (size_t i = 0; i < input.photos.size(); ++i) {
    const DepthPhoto& photo = input.photos[i];
    const bool has_pair = input.ranges[i] && !input.neighbours[i].empty();
    maps.push_back(has_pair
                       ? StereoSgbm(photo, input.photos[input.neighbours[i][0]], *input.ranges[i])
                       : Holes(photo));
  }
  (*times)["stereo_sgbm"] = (CpuSeconds() - start) / static_cast<double>(maps.size());
  return maps;
}

// ---- Output ----

// By inverse depth, over the range of the photo's sparse points; holes are black.
cv::Mat3b Colours(const cv::Mat1f& depth, const DepthRange& range) {
  cv::Mat1b level(depth.size(), 0);
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      if (!(depth(y, x) > 0)) continue;
      const double part = (1 / depth(y, x) - 1 / range.far) / (1 / range.near - 1 / range.far);
      level(y, x) = static_cast<uint8_t>(std::clamp(255 * part, 0.0, 255.0));
    }
  }
  cv::Mat3b colours;
  cv::applyColorMap(level, colours, cv::COLORMAP_TURBO);
  colours.setTo(cv::Vec3b(), depth <= 0);
  return colours;
}

void WritePictures(const std::string& folder, const DepthScene& scene, const DepthInput& input,
                   const std::vector<DepthMap>& maps, const std::vector<DepthMap>& kept) {
  std::filesystem::create_directories(folder);
  for (size_t i = 0; i < maps.size(); ++i) {
    if (!input.ranges[i]) continue;
    cv::Mat row;
    cv::hconcat(std::vector<cv::Mat>{input.colours[i], Colours(maps[i].depth, *input.ranges[i]),
                                     Colours(kept[i].depth, *input.ranges[i])},
                row);
    std::string name = scene.names[i];
    std::replace(name.begin(), name.end(), '/', '_');
    cv::imwrite(folder + "/" + name + ".png", row);
  }
}

json FiguresOf(const DepthInput& input, const std::vector<DepthMap>& maps,
               const std::vector<cv::Mat1f>& truths, const std::vector<cv::Mat1b>& seen) {
  DepthFigures figures;
  for (size_t i = 0; i < truths.size(); ++i) {
    figures.Add(maps[i], truths[i], input.photos[i].grey, seen.empty() ? cv::Mat1b() : seen[i]);
  }
  json out = truths.empty() ? json::object() : figures.ToJson();
  out["completeness_of_photos"] = MeanCompleteness(maps);
  return out;
}

json Run(const Arguments& arguments) {
  const DepthScene scene = ReadDepthScene(arguments);
  const DepthInput input = Prepare(arguments, scene);
  json times;
  const std::vector<DepthMap> maps = Sweep(arguments, input, &times);
  const std::vector<DepthMap> kept = Agreed(input, maps, &times);
  std::vector<cv::Mat1f> truths;
  std::vector<cv::Mat1b> seen;
  json losses;
  if (!arguments.rgbd.empty()) {
    for (size_t i = 0; i < scene.names.size(); ++i) {
      truths.push_back(
          RgbdTruth(arguments.rgbd, scene.names[i], arguments.rig, input.photos[i].camera));
    }
  } else if (!arguments.surfaces.empty()) {
    const sim::Scene surfaces = ReadSurfaces(arguments.surfaces);
    for (const DepthPhoto& photo : input.photos) {
      truths.push_back(TrueDepth(surfaces, photo.camera, photo.cam_from_world));
    }
    const TruePlace place(surfaces, input.photos);
    for (size_t i = 0; i < truths.size(); ++i) {
      seen.push_back(place.SeenByThree(static_cast<int>(i), truths[i]));
    }
    if (arguments.losses) losses = LossesOf(input, maps, kept, place, truths);
  }
  json out = {{"single", FiguresOf(input, maps, truths, seen)},
              {"agreed", FiguresOf(input, kept, truths, seen)}};
  if (arguments.sgbm) {
    const std::vector<DepthMap> pairs = SgbmMaps(input, &times);
    out["stereo_sgbm"] = FiguresOf(input, pairs, truths, seen);
    out["stereo_sgbm_agreed"] = FiguresOf(input, Agreed(input, pairs, &times), truths, seen);
  }
  out["cpu_seconds_a_photo"] = times;
  if (arguments.losses) out["losses"] = losses;
  if (!arguments.rgbd.empty()) {
    out["grey_difference_of_frames"] = RgbdGreyDifference(arguments.rgbd, arguments.rig, 20);
  }
  out["kernel"] = InstructionSetName(arguments.kernel);
  if (!arguments.output.empty()) WritePictures(arguments.output, scene, input, maps, kept);
  return out;
}

InstructionSet KernelOfName(const std::string& name) {
  for (const InstructionSet version : kInstructionSets) {
    if (InstructionSetName(version) == name) return version;
  }
  throw std::runtime_error("no kernel is called " + name);
}

int Main(int argc, char** argv) {
  Arguments arguments;
  std::string kernel;
  CLI::App app("Depth maps of a model's photos, and how good they are");
  app.add_option("--model", arguments.model, "COLMAP model folder");
  app.add_option("--images", arguments.images, "Folder of its photos");
  app.add_option("--rgbd", arguments.rgbd, "Folder of an RGB-D camera's frames, instead");
  app.add_option("--colour-focal-px", arguments.rig.colour_focal_px, "Of the RGB-D camera");
  app.add_option("--colour-offset-m", arguments.rig.colour_offset_m, "Of the RGB-D camera");
  app.add_option("--surfaces", arguments.surfaces, "True surfaces, as skein sim writes them");
  app.add_option("--output", arguments.output, "Folder for pictures");
  app.add_option("--size", arguments.size_px, "Longer side of a depth map, pixels");
  app.add_option("--most", arguments.most, "Photos, the first by name");
  app.add_option("--kernel", kernel, "portable, avx2 or avx512");
  app.add_flag("--sgbm", arguments.sgbm, "Compare with OpenCV's StereoSGBM");
  app.add_flag("--losses", arguments.losses, "Why pixels have no agreed depth; with --surfaces");
  CLI11_PARSE(app, argc, argv);
  if (!arguments.rgbd.empty()) arguments.images = arguments.rgbd;
  try {
    if (!kernel.empty()) arguments.kernel = KernelOfName(kernel);
    std::cout << Run(arguments).dump(1) << "\n";
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "depth_maps: " << error.what() << "\n";
    return 1;
  }
}

}  // namespace
}  // namespace skein

int main(int argc, char** argv) { return skein::Main(argc, argv); }
