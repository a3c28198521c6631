#include "matching/matching_options.h"

#include <CLI/CLI.hpp>

#include "config/kernel_choice.h"
#include "core/option_check.h"

namespace skein {

Status MatchingServiceOptions::Check() const {
  return FirstError({InRange("cache_mib", cache_mib, 1, 1 << 20),
                     InRange("threads", num_threads, 1, 1024), pair.Check()});
}

void AddOptions(CLI::App& app, MatchingServiceOptions* options) {
  MatchOptions& matching = options->pair.matching;
  TwoViewOptions& two_view = options->pair.two_view;
  app.add_option("--cache-mib", options->cache_mib, "Memory for features of recent photos, MiB");
  AddSwitch(app, "second-look", &options->second_look,
            "Order a photo's candidates by what their neighbours matched, and add some; off: all "
            "candidates in the order of retrieval, and no others");
  AddSwitch(
      app, "cascade", &options->pair.cascade,
      "Look at a pair's coarsest features first, then match all with those of near cells; off: "
      "all features with all");
  app.add_option("--codebook", options->codebook_path,
                 "VLAD codebook, whose cells tell the cascade which descriptors may be near each "
                 "other; default: the shipped one");
  AddKernelChoice(app, kKernelVersions, KernelName, FastestKernel(), &matching.kernel,
                  "Matching kernel: the fastest that the processor has, or portable, avx2, "
                  "avx512vnni or amx");
  app.add_option("--max-ratio", matching.max_ratio,
                 "Lowe's, of the distances to the nearest and the second descriptor; 0: no test");
  app.add_option("--max-error", two_view.max_error_px,
                 "Of an inlier of the two views' geometry, pixels (COLMAP: 4)");
  app.add_option("--min-inliers", two_view.min_num_inliers, "Of a verified pair (COLMAP: 15)");
  app.add_option("--min-inlier-ratio", two_view.min_inlier_ratio,
                 "Of the matches, that RANSAC's number of trials assumes (COLMAP: 0.25)");
  app.add_option("--max-trials", two_view.max_num_trials,
                 "Of RANSAC, from the surest matches first (COLMAP: 10000, from all)");
}

}  // namespace skein
