#include "merger/merger_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "config/option_section.h"
#include "core/option_check.h"

namespace skein {

Status MergerOptions::Check() const {
  return FirstError({merge.Check(), InRange("wait_for_mapper", wait_for_mapper_s, 0.0, 3600.0),
                     sim3.Check(), seed.Check(),
                     InRange("decide_period", decide_period_s, 0.001, 3600.0),
                     InRange("request_period", request_period_s, 0.001, 3600.0),
                     InRange("request_timeout", request_timeout_s, 0.001, 3600.0),
                     InRange("idle_mapper", idle_mapper_s, 0.0, 3600.0),
                     InRange("hold_after_refusal", hold_after_refusal_s, 0.0, 3600.0)});
}

void AddOptions(CLI::App& app, MergerOptions* options) {
  SeedOptions& seed = options->seed;
  Sim3Options& sim3 = options->sim3;
  AddSwitch(app, "merge", &options->merge.enabled,
            "Join submaps that overlap; off: leave them apart, for comparison");
  app.add_option(
      "--min-shared-images", options->merge.min_shared_images,
      "Photos that a merge needs: that both submaps hold, or one holds and the other sees");
  app.add_option("--min-inlier-ratio", sim3.min_inlier_ratio,
                 "Share of a photo's common points that must reproject in both directions");
  app.add_option("--max-reprojection-error", sim3.max_reprojection_error_px,
                 "Of an inlier, in pixels of a photo of 1,600 px");
  app.add_option("--trials", sim3.num_trials, "Triples of shared photos to try");
  app.add_option_function<int>(
         "--seed-min-inliers",
         [&seed](int min_inliers) {
           seed.min_inliers = min_inliers;
           seed.min_inliers_at_last = std::min(seed.min_inliers_at_last, min_inliers);
         },
         "Of an initial pair; when finishing 50, or this if it is less")
      ->default_function([&seed] { return std::to_string(seed.min_inliers); })
      ->capture_default_str();
  app.add_option("--wait-for-mapper", options->wait_for_mapper_s,
                 "Seconds that a finish waits for a mapper that could take a seed");
}

}  // namespace skein
