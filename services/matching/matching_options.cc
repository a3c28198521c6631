#include "matching/matching_options.h"

#include <CLI/CLI.hpp>

#include "config/kernel_choice.h"
#include "core/option_check.h"

namespace skein {

Status MatchingServiceOptions::Check() const {
  return FirstError(
      {IsKernelSupported(kernel)
           ? Status::Ok()
           : InvalidArgument("this processor does not run kernel " + KernelName(kernel)),
       InRange("cache_mib", cache_mib, 1, 1 << 20)});
}

void AddOptions(CLI::App& app, MatchingServiceOptions* options) {
  app.add_option("--cache-mib", options->cache_mib, "Memory for features of recent photos, MiB");
  AddSwitch(app, "second-look", &options->second_look,
            "Order a photo's candidates by what their neighbours matched, and add some; off: all "
            "candidates in the order of retrieval, and no others");
  AddSwitch(
      app, "cascade", &options->cascade,
      "Look at a pair's coarsest features first, then match all with those of near cells; off: "
      "all features with all");
  app.add_option("--codebook", options->codebook_path,
                 "VLAD codebook, whose cells tell the cascade which descriptors may be near each "
                 "other; default: the shipped one");
  AddKernelChoice(app, kKernelVersions, KernelName, FastestKernel(), &options->kernel,
                  "Matching kernel: the fastest that the processor has, or portable, avx2, "
                  "avx512vnni, amx, neon or neondot");
}

}  // namespace skein
