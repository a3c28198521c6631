// `skein evaluate`: a model's camera poses against a ground truth.
#pragma once

namespace skein {

int RunEvaluate(int argc, char** argv);

}  // namespace skein
