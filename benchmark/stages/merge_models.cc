// merge_models: what a mapper does at a merge's order, with two submaps as `skein export` writes
// them. It estimates the similarity, adjusts the seam and checks (merging/absorb.h), the smaller
// into the larger. The check along matches that neither submap was built from needs the session,
// and is left out.

#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <stdexcept>
#include <utility>

#include "core/clock.h"
#include "merging/absorb.h"
#include "merging/fuse.h"
#include "sfm/model_files.h"

namespace skein {
namespace {

Reconstruction Read(const std::string& folder) {
  Result<Reconstruction> model = ReadModelFiles(folder);
  if (!model) throw std::runtime_error(model.error());
  return std::move(*model);
}

// Returns the exit code.
int Run(const std::string& first, const std::string& second, const std::string& output) {
  Reconstruction target = Read(first), source = Read(second);
  if (target.NumRegImages() < source.NumRegImages()) std::swap(target, source);
  const double start_s = MonotonicS();
  const std::vector<SharedPhoto> shared = SharedPhotosOf(source, target);
  const AbsorbOptions options;
  const Sim3Result similarity = EstimateSim3(shared, options.sim3);
  AbsorbResult result;
  result.status = FailedPrecondition(similarity.reason);
  if (similarity.success) result = Absorb(target, source, similarity.target_from_source, options);
  const double duration_s = MonotonicS() - start_s;
  std::cout << shared.size() << " shared photos: "
            << (result.status.ok() ? "merged" : "not merged: " + result.status.error()) << ", "
            << std::round(duration_s * 10) / 10 << " s\n";
  if (!result.status.ok()) return 1;
  std::filesystem::create_directories(output);
  const Status written = WriteModelBinary(result.merged, output);
  if (written.ok()) return 0;
  std::cerr << written.error() << "\n";
  return 1;
}

}  // namespace
}  // namespace skein

int main(int argc, char** argv) {
  CLI::App app("Merges two submaps as a mapper does. Exits 1 if they don't merge.");
  std::string first, second, output;
  app.add_option("first", first, "COLMAP model")->required()->check(CLI::ExistingDirectory);
  app.add_option("second", second, "COLMAP model of the same session")
      ->required()
      ->check(CLI::ExistingDirectory);
  app.add_option("output", output, "folder for the merged model")->required();
  CLI11_PARSE(app, argc, argv);
  try {
    return skein::Run(first, second, output);
  } catch (const std::exception& error) {
    std::cerr << "merge_models: " << error.what() << "\n";
    return 2;
  }
}
