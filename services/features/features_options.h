#pragma once

#include "core/result.h"
#include "features/model_choice.h"
#include "features/sift.h"

namespace CLI {
class App;
}

namespace skein {

struct FeaturesOptions {
  SiftOptions sift;
  ModelChoice model;

  Status Check() const;
};

// [features] of a config file.
void AddOptions(CLI::App& app, FeaturesOptions* options);

}  // namespace skein
