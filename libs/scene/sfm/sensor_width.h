#pragma once

#include <optional>
#include <string>

namespace skein {

// Width of a camera's sensor by COLMAP's list; none for a camera that is not on it.
std::optional<double> FindSensorWidthMm(const std::string& make, const std::string& model);

}  // namespace skein
