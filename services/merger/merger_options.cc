#include "merger/merger_options.h"

#include <CLI/CLI.hpp>

#include "config/option_section.h"
#include "core/option_check.h"

namespace skein {

Status MergerOptions::Check() const {
  return FirstError({merge.Check(), InRange("wait_for_mapper", wait_for_mapper_s, 0.0, 3600.0),
                     sim3.Check(), seed.Check()});
}

void AddOptions(CLI::App& app, MergerOptions* options) {
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
  app.add_option("--seed-min-inliers", options->seed.min_inliers,
                 "Of an initial pair; when finishing 50, or this if it is less");
  app.add_option("--wait-for-mapper", options->wait_for_mapper_s,
                 "Seconds that a finish waits for a mapper that could take a seed");
}

}  // namespace skein
