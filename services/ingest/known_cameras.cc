#include "ingest/known_cameras.h"

#include <fnmatch.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <limits>
#include <sstream>

#include "core/limits.h"
#include "sfm/camera.h"

namespace skein {
namespace {

constexpr char kSection[] = "cameras";
constexpr char kExample[] = R"(
# Known intrinsics, an entry a camera; the first that fits a photo counts.
# [[cameras]]
# agent = "drone*"                      # pattern of the agents' names; default: any
# body = "DJI *"                        # pattern of EXIF's make and model; default: any
# size = "4000x3000"                    # of the photos as stored
# camera_model = "SIMPLE_RADIAL"        # COLMAP's; its parameters in pixels, in COLMAP's order
# params = [2800.0, 2000.0, 1500.0, -0.01]
# refine = false                        # true: refined from these on; false: they stay
)";

Status Wrong(const std::string& key, const std::string& what) {
  return InvalidArgument(key + " " + what);
}

std::string One(const ConfigEntry& entry) {
  return entry.values.size() == 1 ? entry.values[0] : "";
}

Status ReadSize(const std::string& text, KnownCamera* camera) {
  char rest = 0;
  if (std::sscanf(text.c_str(), "%dx%d%c", &camera->width_px, &camera->height_px, &rest) == 2) {
    return Status::Ok();
  }
  return Wrong("size", "is \"" + text + "\": give WIDTHxHEIGHT, as \"4000x3000\"");
}

Status ReadParams(const std::vector<std::string>& values, std::vector<double>* params) {
  for (const std::string& value : values) {
    double number = 0;
    const char* end = value.data() + value.size();
    const auto read = std::from_chars(value.data(), end, number);
    if (read.ec != std::errc() || read.ptr != end) {
      return Wrong("params", "has \"" + value + "\": give numbers, as [2800.0, 2000.0, 1500.0]");
    }
    params->push_back(number);
  }
  return Status::Ok();
}

Status ReadRefine(const std::string& text, KnownCamera* camera) {
  camera->refine = text == "true";
  if (camera->refine || text == "false") return Status::Ok();
  return Wrong("refine", "is \"" + text + "\": give true or false");
}

Status ReadEntry(const ConfigEntry& entry, KnownCamera* camera) {
  const std::string& key = entry.key;
  if (key == "agent") {
    camera->agent = One(entry);
  } else if (key == "body") {
    camera->body = One(entry);
  } else if (key == "size") {
    return ReadSize(One(entry), camera);
  } else if (key == "camera_model") {
    camera->camera_model = One(entry);
  } else if (key == "params") {
    return ReadParams(entry.values, &camera->params);
  } else if (key == "refine") {
    return ReadRefine(One(entry), camera);
  } else {
    return Wrong(key, "is no key: agent, body, size, camera_model, params, refine are");
  }
  return Status::Ok();
}

Status ReadSection(const ConfigSection& section, KnownCamera* camera) {
  for (const ConfigEntry& entry : section.entries) {
    if (const Status status = ReadEntry(entry, camera); !status.ok()) return status;
  }
  return camera->Check();
}

bool Matches(const std::string& pattern, const std::string& text) {
  return ::fnmatch(pattern.c_str(), text.c_str(), 0) == 0;
}

std::string NumberText(double value) {
  std::ostringstream text;
  text.precision(std::numeric_limits<double>::max_digits10);
  text << value;
  return text.str();
}

}  // namespace

Status KnownCamera::Check() const {
  if (agent.empty()) return Wrong("agent", "is empty: give a name, or a pattern as \"drone*\"");
  if (body.empty()) return Wrong("body", "is empty: give EXIF's make and model, or leave it out");
  if (width_px < 1 || height_px < 1) {
    return Wrong("size", "is needed, as params are pixels of it: give WIDTHxHEIGHT");
  }
  if (!ExistsCameraModel(camera_model)) {
    return Wrong("camera_model", "is \"" + camera_model + "\": give one of COLMAP's, as OPENCV");
  }
  const int model = CameraModelId(camera_model);
  if (!AreParamsOfModel(model, params)) {
    return Wrong("params", "has " + std::to_string(params.size()) + " values; " + camera_model +
                               " takes " + CameraModelParamsInfo(model));
  }
  const bool finite =
      std::all_of(params.begin(), params.end(), [](double value) { return std::isfinite(value); });
  if (!finite || AsCamera().HasBogusParams(limits::kMinFocalRatio, limits::kMaxFocalRatio,
                                           std::numeric_limits<double>::max())) {
    return Wrong("params", "cannot be of a photo of that size: focal length or principal point");
  }
  return Status::Ok();
}

bool KnownCamera::Fits(const std::string& agent_name, const CheckedPhoto& photo) const {
  return photo.header.width_px == width_px && photo.header.height_px == height_px &&
         Matches(agent, agent_name) && Matches(body, photo.exif.make + " " + photo.exif.model);
}

Camera KnownCamera::AsCamera() const {
  Camera camera;
  camera.SetModelIdFromName(camera_model);
  camera.SetParams(params);
  camera.SetWidth(width_px);
  camera.SetHeight(height_px);
  return camera;
}

double KnownCamera::FocalPx() const { return AsCamera().MeanFocalLength(); }

std::string KnownCamera::Text() const {
  std::string values;
  for (const double value : params) values += (values.empty() ? "" : ", ") + NumberText(value);
  return "[[cameras]]\nagent = \"" + agent + "\"\nbody = \"" + body + "\"\nsize = \"" +
         std::to_string(width_px) + "x" + std::to_string(height_px) + "\"\ncamera_model = \"" +
         camera_model + "\"\nparams = [" + values + "]\nrefine = " + (refine ? "true" : "false") +
         "\n";
}

Status ReadKnownCameras(const ConfigFile& file, std::vector<KnownCamera>* cameras) {
  for (const ConfigSection& section : file.sections) {
    if (section.name != kSection) continue;
    KnownCamera camera;
    const Status status = ReadSection(section, &camera);
    if (!status.ok()) {
      return InvalidArgument(file.path + ": [[cameras]], entry " +
                             std::to_string(cameras->size() + 1) + ": " + status.error());
    }
    cameras->push_back(camera);
  }
  return Status::Ok();
}

const KnownCamera* FindKnownCamera(const std::vector<KnownCamera>& cameras,
                                   const std::string& agent, const CheckedPhoto& photo) {
  const auto found = std::find_if(cameras.begin(), cameras.end(), [&](const KnownCamera& camera) {
    return camera.Fits(agent, photo);
  });
  return found == cameras.end() ? nullptr : &*found;
}

std::string KnownCamerasText(const std::vector<KnownCamera>& cameras, bool with_comments) {
  std::string text = with_comments ? kExample : "";
  for (const KnownCamera& camera : cameras) text += "\n" + camera.Text();
  return text;
}

}  // namespace skein
