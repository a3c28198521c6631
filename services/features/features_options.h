#pragma once

#include "core/result.h"
#include "features/model_choice.h"
#include "features/sift.h"
#include "photo/photo_decoder.h"

namespace CLI {
class App;
}

namespace skein {

struct FeaturesOptions {
  SiftOptions sift;
  ModelChoice model;
  DecoderOptions decoder;

  Status Check() const;
};

// [features] of a config file.
void AddOptions(CLI::App& app, FeaturesOptions* options);

}  // namespace skein
