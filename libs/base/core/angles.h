#pragma once

namespace skein {

constexpr double DegToRad(double degrees) {
  return degrees * 0.0174532925199432954743716805978692718;
}
constexpr double RadToDeg(double radians) {
  return radians * 57.29577951308232286464772187173366547;
}

}  // namespace skein
