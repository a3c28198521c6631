#include "mapper/mapper_options.h"

#include <CLI/CLI.hpp>

#include "config/option_section.h"
#include "core/option_check.h"

namespace skein {
Status MapperOptions::Check() const {
  return FirstError({run.Check(), InRange("retire_after", retire_after_s, 0.0, 1e9)});
}

void AddOptions(CLI::App& app, MapperOptions* options) {
  SubmapOptions& submap = options->run.submap;
  app.add_option(
      "--camera-model", submap.camera_model,
      "Camera model where intrinsics are not given: auto, what the photos call for, or one of "
      "COLMAP's");
  app.add_option("--local-ba-images", submap.local_ba_images,
                 "Images that a local bundle adjustment takes in, two of them constant");
  AddSwitch(app, "background-ba", &submap.background,
            "Global bundle adjustment beside registration; off: in turn with it, and the same "
            "ledger gives the same map");
  AddSwitch(app, "one-home", &options->run.one_home,
            "A photo is tried by the submap that it overlaps most; off: by every submap that it "
            "overlaps, as in the paper");
  app.add_option("--target-gsd", options->run.target_gsd_mm,
                 "Millimetres of the surface that a pixel may cover for the final models' "
                 "completeness, where GPS tells the scale; 0: twice that of the median point");
  app.add_option("--retire-after", options->retire_after_s,
                 "End after so many seconds without a submap; 0: never")
      ->configurable(false)
      ->capture_default_str();
}

}  // namespace skein
