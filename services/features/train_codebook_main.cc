// Trains the codebook of the embedded global descriptor from photos.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <opencv2/core.hpp>

#include "core/file.h"
#include "core/folder.h"
#include "features/sift.h"
#include "features/train_codebook.h"
#include "photo/image_view.h"
#include "photo/photo_decoder.h"

namespace fs = std::filesystem;

namespace {

std::vector<std::string> PhotosIn(const std::vector<std::string>& folders) {
  std::vector<std::string> paths;
  for (const auto& folder : folders) {
    for (const fs::path& file : skein::FilesUnder(folder)) paths.push_back(file);
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

// Features of the photo and of `num_views` augmented views of it.
void Describe(skein::PhotoDecoder* decoder, const std::string& path, int num_views, uint64_t seed,
              const skein::SiftOptions& sift, std::vector<skein::LocalFeatures>* features) {
  const auto bytes = skein::ReadFile(path);
  if (!bytes) throw std::runtime_error(bytes.error());
  const auto photo = decoder->Decode(*bytes);
  if (!photo) {
    std::fprintf(stderr, "skipped %s: %s\n", path.c_str(), photo.error().c_str());
    return;
  }
  features->push_back(skein::ExtractSift(photo->image, sift));
  const cv::Mat small = skein::ShrinkTo(photo->image, sift.max_image_px);
  for (int view = 0; view < num_views; ++view) {
    features->push_back(skein::ExtractSift(skein::AugmentPhoto(small, seed + view), sift));
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> folders;
  std::string output;
  std::string id;
  int num_views = 1;
  skein::SiftOptions sift;
  skein::TrainingOptions options;
  CLI::App app("Trains a VLAD codebook from all photos in the given folders.");
  app.add_option("--images", folders, "Folders of photos")
      ->required()
      ->check(CLI::ExistingDirectory);
  app.add_option("--output", output, "File to write")->required();
  app.add_option("--id", id, "Identity, e.g. vlad-1; change it with every training")->required();
  app.add_option("--views", num_views, "Augmented views a photo")->capture_default_str();
  app.add_option("--cells", options.num_cells, "Cells")->capture_default_str();
  app.add_option("--local-dim", options.local_dim, "Dimensions kept of SIFT")
      ->capture_default_str();
  app.add_option("--cell-dim", options.cell_dim, "Dimensions kept of a cell")
      ->capture_default_str();
  app.add_option("--seed", options.seed, "Random seed")->capture_default_str();
  app.add_option("--max-size", sift.max_image_px, "Longest side, pixels")->capture_default_str();
  app.add_option("--max-features", sift.max_features, "Keypoints of a photo")
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    const auto paths = PhotosIn(folders);
    std::vector<skein::LocalFeatures> features;
    const auto decoder = skein::PhotoDecoder::Start();
    if (!decoder.ok()) throw std::runtime_error(decoder.error());
    for (size_t i = 0; i < paths.size(); ++i) {
      Describe(decoder->get(), paths[i], num_views, options.seed + i * num_views, sift, &features);
      std::fprintf(stderr, "\r%zu of %zu photos", i + 1, paths.size());
    }
    std::fprintf(stderr, "\n");
    const auto codebook = skein::TrainCodebook(features, id, options);
    const auto written = skein::WriteFileAtomic(output, skein::EncodeCodebook(codebook));
    if (!written.ok()) throw std::runtime_error(written.error());
    std::printf("%s: %s, %zu photos, %zu views, %d x %d values\n", output.c_str(), id.c_str(),
                paths.size(), features.size(), codebook.num_cells(), codebook.cell_dim());
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "skein-train-codebook: %s\n", error.what());
    return 1;
  }
}
