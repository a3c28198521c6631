// A scenario: a place, and a walk for each agent.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "clients/places/camera.h"
#include "clients/places/place.h"

namespace skein::sim {

enum class Scenario {
  kTogether,      // all agents around one building, from one spot, in both directions
  kDisjoint,      // each agent along its own part of a square; late photos reach the next one's
  kRelay,         // the same walks one after the other
  kRooms,         // each agent in its own room, then through a corridor into the next one's
  kTwins,         // two squares around buildings of one design: never to be taken for one
  kSharedObject,  // two rooms, each with a vending machine of one design
  kFurniture,     // all agents around one hall with rows of equal tables
  kCorridor,      // all camera centres on one line
  kVideo,         // each agent films its own part of one room by hand
  kBlank,         // all agents around one room with painted walls
  kCrowd,         // all agents are tourists before one monument
  kCourtyard,     // all agents around one yard between façades of equal bays
  kStockpile,     // each agent flies around a heap, then over it
  kSurvey,        // drones fly lanes over one town, 0.11 hectares a photo
};
std::optional<Scenario> ParseScenario(const std::string& name);
std::vector<std::string> ScenarioNames();

struct Shot {
  Pose pose;
  double capture_s;  // after the beginning of the session
  Motion motion;     // at that time; the pose is that of the photo's middle row
};

struct Walk {
  std::string agent;
  std::vector<Shot> shots;
};

struct ScenarioOptions {
  Scenario scenario = Scenario::kTogether;
  int agents = 3;
  int photos = 20;  // of each agent
  uint64_t seed = 1;

  // Between two photos of an agent.
  double IntervalS() const { return scenario == Scenario::kVideo ? 0.1 : 3; }
};

// Hand-held: centre and view direction jitter (except across the line of kCorridor). Cameras move
// only in kVideo.
std::vector<Walk> PlanWalks(const ScenarioOptions& options);
Place BuildPlace(const ScenarioOptions& options, int threads);

}  // namespace skein::sim
