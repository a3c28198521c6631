#include <CLI/CLI.hpp>

#include "mapper/mapper_service.h"
#include "node/node.h"

int main(int argc, char** argv) {
  skein::NodeOptions options;
  options.service = "mapper";
  skein::SubmapRunOptions run;
  run.submap.background = true;
  std::string local_ba = skein::NameOf(run.submap.local.form);
  double retire_after_s = 0;

  CLI::App app("Registers photos in one submap: poses, points, bundle adjustment.");
  skein::AddCommonOptions(app, &options);
  app.add_option("--local-ba", local_ba, "Local bundle adjustment")
      ->check(CLI::IsMember(skein::LocalBaForms()))
      ->capture_default_str();
  app.add_option("--camera-model", run.submap.camera_model, "One of COLMAP's camera models")
      ->capture_default_str();
  app.add_option("--local-ba-images", run.submap.local.colmap_images,
                 "Images that --local-ba colmap takes in, two of them constant")
      ->check(CLI::Range(3, 1000))
      ->capture_default_str();
  app.add_option("--local-ba-free", run.submap.local.max_free,
                 "Most images that the other forms refine; 0: no limit")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--local-ba-held", run.submap.local.max_held,
                 "Most images that they hold constant; 0: no limit")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--checkpoint-photos", run.checkpoint_photos,
                 "Photos between checkpoints, at least")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--retire-after", retire_after_s,
                 "End after so many seconds without a submap; 0: never")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_flag(
      "!--no-background-ba", run.submap.background,
      "Global bundle adjustment in turn with registration: the same ledger gives the same map");
  if (const auto code = skein::ParseCommandLine(app, argc, argv)) return *code;

  return skein::RunService(options, [&](skein::Node& node) {
    run.submap.num_threads = options.threads;
    run.submap.local.form = skein::LocalBaForms().at(local_ba);
    skein::MapperService service(node, run, retire_after_s);
    node.Run();
  });
}
