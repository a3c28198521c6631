#include "guide/sentences.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

#include "core/angles.h"

namespace skein {
namespace {

constexpr size_t kMaxParts = 2;  // of an offset: the longest
constexpr double kMinTurnDeg = 7.5;
constexpr double kMinPart = 0.06;  // of the distance to the object: less is not spoken of

const char* WhyText(Station::Why why) {
  switch (why) {
    case Station::Why::kFewPhotos:
      return "too few photos see this place";
    case Station::Why::kNoParallax:
      return "the photos of this place were taken too close together";
    case Station::Why::kTooSlanted:
      return "the photos of this place look at it at too flat an angle";
    case Station::Why::kTooFar:
      return "the photos of this place were taken from too far away";
    case Station::Why::kOpenBorder:
      return "the surface goes on here, and no photo shows it yet";
  }
  return "";
}

std::string Number(const char* format, double value) {
  char text[32];
  std::snprintf(text, sizeof(text), format, value);
  return text;
}

// As a part of the distance to the object, which the first part of a sentence names.
std::string PartText(double part, bool is_first) {
  struct Word {
    double part;
    const char* text;
    const char* first;
  };
  static constexpr std::array<Word, 9> kWords = {
      {{0.1, "a tenth", "a tenth of the distance"},
       {0.25, "a quarter", "a quarter of the distance"},
       {1.0 / 3, "a third", "a third of the distance"},
       {0.5, "half of it", "half the distance"},
       {2.0 / 3, "two thirds", "two thirds of the distance"},
       {0.75, "three quarters", "three quarters of the distance"},
       {1, "as far", "the distance"},
       {1.5, "one and a half times as far", "one and a half times the distance"},
       {2, "twice as far", "twice the distance"}}};
  const Word* word =
      std::min_element(kWords.begin(), kWords.end(), [part](const Word& a, const Word& b) {
        return std::abs(std::log(a.part / part)) < std::abs(std::log(b.part / part));
      });
  const bool is_many = part >= 2.5;
  if (!is_first) return is_many ? Number("%.0f times as far", part) : word->text;
  const std::string text = is_many ? Number("%.0f times the distance", part) : word->first;
  return text + " to the object,";
}

std::string LengthText(const Wording& wording, double length, bool is_first) {
  if (wording.metres_per_unit <= 0) return PartText(length / wording.working_distance, is_first);
  const double metres = length * wording.metres_per_unit;
  if (metres < 1) return Number("%.0f cm", 100 * metres);
  return Number(metres < 10 ? "%.1f m" : "%.0f m", metres);
}

// Where a photographer faces, level; of a camera that looks straight up or down, where the upper
// side of its photo is.
Eigen::Vector3d Heading(const CameraPose& pose, const Eigen::Vector3d& up) {
  constexpr double kSteep = 0.9;
  const Eigen::Vector3d ahead = AheadOf(pose);
  const Eigen::Vector3d top = UpperSideOf(pose);
  const Eigen::Vector3d& facing = std::abs(ahead.dot(up)) > kSteep ? top : ahead;
  const Eigen::Vector3d level = facing - facing.dot(up) * up;
  return level.norm() > 1e-6 ? level.normalized() : up.unitOrthogonal();
}

// Of where the camera looks, above level.
double PitchDeg(const CameraPose& pose, const Eigen::Vector3d& up) {
  const Eigen::Vector3d ahead = AheadOf(pose);
  return RadToDeg(std::asin(std::clamp(ahead.dot(up), -1.0, 1.0)));
}

struct Part {
  double length;
  const char* where;
};

// "2.1 m to the left and 40 cm higher", "" where it is the same place.
std::string OffsetText(const Wording& wording, const CameraPose& near, const CameraPose& there) {
  const Eigen::Vector3d offset = there.Centre() - near.Centre();
  const Eigen::Vector3d ahead = Heading(near, wording.up);
  const Eigen::Vector3d right = ahead.cross(wording.up);
  const std::array<double, 3> along = {offset.dot(right), offset.dot(ahead),
                                       offset.dot(wording.up)};
  static constexpr const char* kWords[3][2] = {
      {"to the left", "to the right"}, {"back", "forward"}, {"lower", "higher"}};
  std::vector<Part> parts;
  double longest = 0;
  for (const double length : along) longest = std::max(longest, std::abs(length));
  for (size_t axis = 0; axis < along.size(); ++axis) {
    const double length = std::abs(along[axis]);
    if (length < kMinPart * wording.working_distance || length < 0.2 * longest) continue;
    parts.push_back({length, kWords[axis][along[axis] > 0]});
  }
  std::sort(parts.begin(), parts.end(),
            [](const Part& a, const Part& b) { return a.length > b.length; });
  if (parts.size() > kMaxParts) parts.resize(kMaxParts);
  std::string text;
  for (size_t i = 0; i < parts.size(); ++i) {
    text += i == 0 ? "" : " and ";
    text += LengthText(wording, parts[i].length, i == 0) + " " + parts[i].where;
  }
  return text;
}

std::string AngleText(double degrees) {
  return Number("%.0f", 5 * std::round(std::abs(degrees) / 5)) + " degrees";
}

// ", turned 20 degrees to the right, tilted 15 degrees down"
std::string TurnText(const Wording& wording, const CameraPose& near, const CameraPose& there) {
  const Eigen::Vector3d before = Heading(near, wording.up), after = Heading(there, wording.up);
  const double to_left_deg =
      RadToDeg(std::atan2(before.cross(after).dot(wording.up), before.dot(after)));
  const double tilt_deg = PitchDeg(there, wording.up) - PitchDeg(near, wording.up);
  std::string text;
  if (std::abs(to_left_deg) >= kMinTurnDeg) {
    text += ", turned " + AngleText(to_left_deg);
    text += std::abs(to_left_deg) > 172.5 ? "" : to_left_deg > 0 ? " to the left" : " to the right";
  }
  if (std::abs(tilt_deg) >= kMinTurnDeg) {
    text += ", tilted " + AngleText(tilt_deg) + (tilt_deg > 0 ? " up" : " down");
  }
  return text;
}

}  // namespace

std::string StationSentence(const Wording& wording, const std::string& near_name,
                            const CameraPose& near, const Station& station) {
  const std::string offset = OffsetText(wording, near, station.cam_from_world);
  std::string text = offset.empty() ? "" : offset + " from ";
  text += "where " + near_name + " was taken" + TurnText(wording, near, station.cam_from_world);
  return text + ": " + WhyText(station.why);
}

}  // namespace skein
