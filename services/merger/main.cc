#include <CLI/CLI.hpp>

#include "merger/merger_service.h"

int main(int argc, char** argv) {
  skein::NodeOptions node_options;
  node_options.service = "merger";
  skein::MergerOptions options;
  bool no_merge = false;
  CLI::App app("Starts submaps where photos have none, and joins submaps that overlap.");
  skein::AddCommonOptions(app, &node_options);
  app.add_flag("--no-merge", no_merge, "Leave the submaps apart, for comparison");
  app.add_option("--min-shared-images", options.merge.min_shared_images,
                 "Shared photos that a merge needs")
      ->capture_default_str()
      ->check(CLI::Range(3, 1000));
  app.add_option("--min-inlier-ratio", options.sim3.min_inlier_ratio,
                 "Share of a photo's common points that must reproject in both directions")
      ->capture_default_str()
      ->check(CLI::Range(0.01, 1.0));
  app.add_option("--max-reprojection-error", options.sim3.max_reprojection_error_px,
                 "Of an inlier, in pixels of a photo of 1,600 px")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  app.add_option("--trials", options.sim3.num_trials, "Triples of shared photos to try")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000000));
  app.add_option("--seed-min-inliers", options.seed.min_inliers, "Of an initial pair")
      ->capture_default_str()
      ->check(CLI::Range(15, 100000));
  if (const auto code = skein::ParseCommandLine(app, argc, argv)) return *code;
  options.merge.enabled = !no_merge;
  options.seed.min_inliers_at_last =
      std::min(options.seed.min_inliers_at_last, options.seed.min_inliers);
  return skein::RunService(node_options, [&](skein::Node& node) {
    skein::MergerService service(node, options);
    node.Run();
  });
}
