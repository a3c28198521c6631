#include <CLI/CLI.hpp>
#include <map>

#include "matching/matching_service.h"
#include "node/node.h"

int main(int argc, char** argv) {
  skein::NodeOptions options;
  options.service = "matching";
  options.cache_bytes = size_t{32} << 20;  // decoded features have a cache of their own
  int cache_mib = 512;
  bool plain = false;
  skein::KernelVersion kernel = skein::FastestKernel();
  const std::map<std::string, skein::KernelVersion> kernels{
      {"portable", skein::KernelVersion::kPortable},
      {"avx2", skein::KernelVersion::kAvx2},
      {"avx512vnni", skein::KernelVersion::kAvx512Vnni}};

  CLI::App app("Matches each photo with its candidates and verifies the geometry of each pair.");
  skein::AddCommonOptions(app, &options);
  app.add_option("--cache-mib", cache_mib, "Memory for features of recent photos, MiB")
      ->check(CLI::Range(1, 1 << 20))
      ->capture_default_str();
  app.add_flag("--no-second-look", plain,
               "Match with all candidates in the order of retrieval, and no others");
  app.add_option("--kernel", kernel, "Matching kernel; default: the fastest supported")
      ->transform(CLI::CheckedTransformer(kernels, CLI::ignore_case)
                      .description("avx512vnni, avx2 or portable"));
  if (const auto code = skein::ParseCommandLine(app, argc, argv)) return *code;

  return skein::RunService(options, [&](skein::Node& node) {
    skein::MatchingServiceOptions service_options;
    service_options.cache_bytes = static_cast<size_t>(cache_mib) << 20;
    service_options.second_look.enabled = !plain;
    service_options.matcher.matching.kernel = kernel;
    service_options.matcher.num_threads = options.threads;
    skein::MatchingService service(node, service_options);
    node.Run();
  });
}
