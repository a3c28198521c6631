#include "clients/sim/scenario.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "clients/places/crowd.h"
#include "clients/places/indoors.h"
#include "clients/places/outdoors.h"
#include "clients/places/plain_room.h"
#include "clients/places/random.h"
#include "clients/sim/video_walk.h"

namespace skein::sim {
namespace {

using Eigen::Vector3d;

constexpr double kEyeM = 1.65;
constexpr double kTwinDistanceM = 130;

constexpr double kCorridorStepM = 0.45;
constexpr double kCorridorOwnShare = 0.72;  // of an agent's photos before the next one's begin
constexpr double kCorridorMarginM = 3;

// A photo shows 140 x 105 m of the ground. Lanes share 68 % of that, photos of a lane 76 %.
constexpr double kSurveyAltitudeM = 120, kSurveyStepM = 25, kSurveyLaneM = 45;

constexpr double kVideoOwnShare = 0.8;  // of an agent's frames before the next one's begin
constexpr double kVideoWallM = 1.2;     // from the walls

struct Aim {
  Vector3d center, target;
};

// Around the square's middle, looking at the building there.
Aim OrbitView(const Vector3d& middle, double radius_m, double angle) {
  const Vector3d out(std::cos(angle), std::sin(angle), 0);
  return {middle + radius_m * out + Vector3d(0, 0, kEyeM), middle + Vector3d(0, 0, 3.4)};
}

Aim TogetherView(const ScenarioOptions& options, const Vector3d& middle, double radius_m, int agent,
                 int i) {
  const double step = std::clamp(195.0 / options.photos, 2.5, 9.5) * kDegree;
  const double direction = agent % 2 == 0 ? 1 : -1;
  const double phase = 0.5 * (agent / 2);
  return OrbitView(middle, radius_m, direction * step * (i + phase));
}

// Far enough away to have the whole house in the frame, with what stands around it.
Aim TwinView(const ScenarioOptions& options, int agent, int i) {
  const Vector3d middle(kTwinDistanceM * (agent % 2), 0, 0);
  const int walk = agent / 2;
  return TogetherView(options, middle, 15.6 + 1.2 * (walk % 3), walk, i);
}

// Along the façades of the ring, looking outwards. The last sixth of an agent's photos shows
// where the next agent began.
Aim RingView(const ScenarioOptions& options, int agent, int i) {
  const double share = 1.2 * 360 / options.agents / options.photos;
  const double step = std::clamp(share, 2.0, 7.25) * kDegree;
  const double angle = step * (agent * options.photos / 1.2 + i);
  const Vector3d out(std::cos(angle), std::sin(angle), 0);
  return {16 * out + Vector3d(0, 0, kEyeM), kRingFrontM * out + Vector3d(0, 0, 3.2)};
}

// Turns on the spot's circle and looks across the room, first away from both corridors. Then walks
// east into the next room.
Aim RoomsView(const ScenarioOptions& options, int agent, int i) {
  constexpr double kBack = 1.5, kMaxTurn = 15 * kDegree, kFirstHeading = -110 * kDegree;
  const bool last = agent + 1 == options.agents;
  const int passage = last ? 0 : std::min(options.photos / 2, 18);
  const int turning = options.photos - passage;
  const Vector3d room(agent * kRoomPitchM, 0, kEyeM - 0.1);
  const double turn = std::min(kMaxTurn, -kFirstHeading / std::max(1, turning - 1));
  const double heading = i < turning ? turn * (i + 1 - turning) : 0;
  const Vector3d forward(std::cos(heading), std::sin(heading), 0);
  const double walked = i < turning ? 0 : kRoomPitchM * (i + 1 - turning) / passage;
  const Vector3d center = room - kBack * forward + Vector3d(walked, 0, 0);
  const double glance = i < turning ? 0 : 12 * kDegree * std::sin(M_PI * walked / kRoomPitchM);
  return {center,
          center + 4 * Vector3d(std::cos(heading + glance), std::sin(heading + glance), -0.03)};
}

Aim CorridorView(const ScenarioOptions& options, int agent, int i) {
  const double x =
      kCorridorMarginM + kCorridorStepM * (agent * options.photos * kCorridorOwnShare + i);
  const Vector3d center(x, -0.9, 1.5);
  return {center, center + Vector3d(std::cos(60 * kDegree), std::sin(60 * kDegree), -0.05)};
}

double CorridorLength(const ScenarioOptions& options) {
  const Aim last = CorridorView(options, options.agents - 1, options.photos - 1);
  return last.center.x() + 2 * kCorridorMarginM;
}

// Along an ellipse, `stretch` times as long as wide; looks across the room, past its middle.
Aim RoomView(const ScenarioOptions& options, double radius_m, double stretch, int agent, int i) {
  const double step = std::clamp(400.0 / options.photos, 5.0, 18.0) * kDegree;
  const double angle = (agent % 2 == 0 ? 1 : -1) * step * (i + 0.5 * (agent / 2));
  const Vector3d center(stretch * radius_m * std::cos(angle), radius_m * std::sin(angle),
                        kEyeM - 0.1);
  const double heading = angle + M_PI + 14 * kDegree * std::sin(1.6 * angle);
  return {center, center + 4 * Vector3d(std::cos(heading), std::sin(heading), -0.1)};
}

Aim BlankView(const ScenarioOptions& options, int agent, int i) {
  return RoomView(options, 1.25 + 0.2 * (agent % 3), 1.3, agent, i);
}

// Odd agents are in one room, even agents in the other.
Aim SharedObjectView(const ScenarioOptions& options, int agent, int i) {
  const Vector3d middle(kRoomPitchM * (agent % 2), 0, 0);
  const Aim view = BlankView(options, agent / 2, i);
  return {middle + view.center, middle + view.target};
}

// Between the tables and the walls.
Aim FurnitureView(const ScenarioOptions& options, int agent, int i) {
  return RoomView(options, 2.9 + 0.15 * (agent % 3), 1.55, agent, i);
}

// Across the yard, at the opposite façades up to their roofs.
Aim CourtyardView(const ScenarioOptions& options, int agent, int i) {
  const Aim view = RoomView(options, 6.5 + 0.5 * (agent % 3), 1.2, agent, i);
  return {view.center, view.target + Vector3d(0, 0, 1.2)};
}

// Over the heap in two lines, looking forward and down. `share`: of the way.
Aim OverflightView(double share) {
  constexpr double kAltitudeM = 16, kForwardM = 7, kReachM = 8, kAsideM = 4;
  const double heading = share < 0.5 ? 1 : -1;
  const double along = heading * kReachM * (share < 0.5 ? 4 * share - 1 : 4 * share - 3);
  return {{along, -heading * kAsideM, kAltitudeM},
          {along + heading * kForwardM, -heading * kAsideM, 0}};
}

// Two thirds of the photos around the heap; each agent begins and flies in another direction.
Aim StockpileView(const ScenarioOptions& options, int agent, int i) {
  constexpr double kRadiusM = 13, kAltitudeM = 11;
  const int orbit = (2 * options.photos + 2) / 3;
  const double begin = 2 * M_PI * agent / options.agents;
  if (i < orbit) {
    const double angle = begin + i * std::clamp(360.0 / orbit, 4.0, 15.0) * kDegree;
    return {{kRadiusM * std::cos(angle), kRadiusM * std::sin(angle), kAltitudeM},
            {0, 0, kStockpileHeightM / 2}};
  }
  const Aim view = OverflightView((i - orbit + 0.5) / (options.photos - orbit));
  const Eigen::AngleAxisd turn(begin, Vector3d::UnitZ());
  return {turn * view.center, turn * view.target};
}

int SurveyLanes(const ScenarioOptions& options) {
  const double area = options.agents * options.photos * kSurveyStepM * kSurveyLaneM;
  return std::max(1, static_cast<int>(std::lround(std::sqrt(area) / kSurveyLaneM)));
}

int SurveyPhotosOfALane(const ScenarioOptions& options) {
  const int lanes = SurveyLanes(options);
  return (options.agents * options.photos + lanes - 1) / lanes;
}

// To and fro in lanes, looking down; an agent goes on where the one before it ends.
Aim SurveyView(const ScenarioOptions& options, int agent, int i) {
  constexpr double kForwardM = 10;
  const int lanes = SurveyLanes(options), photos = SurveyPhotosOfALane(options);
  const int at = agent * options.photos + i, lane = at / photos, step = at % photos;
  const double heading = lane % 2 == 0 ? 1 : -1;
  const Vector3d center(heading * kSurveyStepM * (step - 0.5 * (photos - 1)),
                        kSurveyLaneM * (lane - 0.5 * (lanes - 1)), kSurveyAltitudeM);
  return {center, center + Vector3d(heading * kForwardM, 0, -kSurveyAltitudeM)};
}

// With what the outermost photos see.
double SurveySize(const ScenarioOptions& options) {
  return std::max(SurveyPhotosOfALane(options) * kSurveyStepM,
                  SurveyLanes(options) * kSurveyLaneM) +
         2 * kSurveyAltitudeM;
}

PlainRoomSpec VideoRoom(const ScenarioOptions& options) {
  PlainRoomSpec room;
  room.half_m.x() = std::min(9.0, 3.2 + 1.2 * (options.agents - 1));
  room.furnished = 0.8;
  room.seed = options.seed;
  return room;
}

// An agent begins where the one before it has taken its own share of the frames.
Shot VideoShot(const ScenarioOptions& options, int agent, int i) {
  constexpr double kMotionS = 0.02;
  VideoWalk walk;
  walk.half_axes_m = VideoRoom(options).half_m.array() - kVideoWallM;
  const double interval_s = options.IntervalS();
  const double own_s = kVideoOwnShare * options.photos * interval_s;
  walk.start_m = agent * VideoDistance(walk, own_s);
  walk.hand_seed = Random(options.seed ^ 0x68616e64ULL).Fork(agent).Next();
  const double at_s = (i + 1) * interval_s;
  return {VideoPose(walk, at_s), i * interval_s,
          MotionBetween(VideoPose(walk, at_s - kMotionS / 2), VideoPose(walk, at_s + kMotionS / 2),
                        kMotionS)};
}

Aim PlanView(const ScenarioOptions& options, int agent, int i) {
  switch (options.scenario) {
    case Scenario::kTogether:
      return TogetherView(options, Vector3d::Zero(), 12.6 + 1.2 * (agent % 4), agent, i);
    case Scenario::kTwins:
      return TwinView(options, agent, i);
    case Scenario::kRooms:
      return RoomsView(options, agent, i);
    case Scenario::kCorridor:
      return CorridorView(options, agent, i);
    case Scenario::kBlank:
      return BlankView(options, agent, i);
    case Scenario::kSharedObject:
      return SharedObjectView(options, agent, i);
    case Scenario::kFurniture:
      return FurnitureView(options, agent, i);
    case Scenario::kCourtyard:
      return CourtyardView(options, agent, i);
    case Scenario::kStockpile:
      return StockpileView(options, agent, i);
    case Scenario::kSurvey:
      return SurveyView(options, agent, i);
    default:
      return RingView(options, agent, i);
  }
}

Pose HandHeld(const Aim& view, Scenario scenario, Random* random) {
  Vector3d sway(random->Gaussian() * 0.05, random->Gaussian() * 0.05, random->Gaussian() * 0.03);
  if (scenario == Scenario::kCorridor) sway.tail<2>().setZero();
  const Vector3d center = view.center + sway;
  const double distance = (view.target - view.center).norm();
  const Vector3d aim(random->Gaussian(), random->Gaussian(), random->Gaussian());
  return LookAt(center, view.target + sway + aim * distance * 1.0 * kDegree,
                random->Gaussian() * 1.0 * kDegree);
}

Shot PlanShot(const ScenarioOptions& options, int agent, int i, Random* random) {
  const double capture_s = i * options.IntervalS();
  switch (options.scenario) {
    case Scenario::kVideo:
      return VideoShot(options, agent, i);
    case Scenario::kCrowd:
      return {TouristPose(random), capture_s, {}};
    default:
      return {HandHeld(PlanView(options, agent, i), options.scenario, random), capture_s, {}};
  }
}

const std::vector<std::pair<std::string, Scenario>>& Table() {
  static const std::vector<std::pair<std::string, Scenario>> table = {
      {"together", Scenario::kTogether},   {"disjoint", Scenario::kDisjoint},
      {"relay", Scenario::kRelay},         {"rooms", Scenario::kRooms},
      {"twins", Scenario::kTwins},         {"shared-object", Scenario::kSharedObject},
      {"furniture", Scenario::kFurniture}, {"corridor", Scenario::kCorridor},
      {"video", Scenario::kVideo},         {"blank", Scenario::kBlank},
      {"crowd", Scenario::kCrowd},         {"courtyard", Scenario::kCourtyard},
      {"stockpile", Scenario::kStockpile}, {"survey", Scenario::kSurvey}};
  return table;
}

void AddTwins(const Random& random, PlaceBuilder* builder) {
  const uint64_t design = random.Fork(2).Next();
  AddSquare({{0, 0}, random.Fork(1).Next(), design, random.Fork(4).Next()}, builder);
  AddSquare({{kTwinDistanceM, 0}, random.Fork(3).Next(), design, random.Fork(5).Next()}, builder);
}

void AddCanteen(uint64_t seed, PlaceBuilder* builder) {
  PlainRoomSpec hall;
  hall.half_m = {6.2, 4.4};
  hall.furnished = 0.6;
  hall.seed = seed;
  hall.table_columns = 4;
  AddPlainRoom(hall, builder);
}

bool IsIndoors(Scenario scenario) {
  switch (scenario) {
    case Scenario::kRooms:
    case Scenario::kCorridor:
    case Scenario::kVideo:
    case Scenario::kBlank:
    case Scenario::kSharedObject:
    case Scenario::kFurniture:
      return true;
    default:
      return false;
  }
}

}  // namespace

std::optional<Scenario> ParseScenario(const std::string& name) {
  for (const auto& [text, scenario] : Table()) {
    if (text == name) return scenario;
  }
  return std::nullopt;
}

std::vector<std::string> ScenarioNames() {
  std::vector<std::string> names;
  for (const auto& row : Table()) names.push_back(row.first);
  return names;
}

std::vector<Walk> PlanWalks(const ScenarioOptions& options) {
  const Random base(options.seed ^ 0x77616c6bULL);
  std::vector<Walk> walks;
  for (int agent = 0; agent < options.agents; ++agent) {
    Random random = base.Fork(agent);
    Walk walk;
    walk.agent = "agent-" + std::to_string(agent + 1);
    const double start_s = options.scenario == Scenario::kRelay
                               ? agent * options.photos * options.IntervalS()
                               : 0.37 * options.IntervalS() * agent / 3;
    for (int i = 0; i < options.photos; ++i) {
      walk.shots.push_back(PlanShot(options, agent, i, &random));
      walk.shots.back().capture_s += start_s;
    }
    walks.push_back(std::move(walk));
  }
  return walks;
}

Place BuildPlace(const ScenarioOptions& options, int threads) {
  PlaceBuilder builder(options.seed);
  const Random random(options.seed);
  switch (options.scenario) {
    case Scenario::kRooms:
      AddRooms(options.agents, options.seed, &builder);
      break;
    case Scenario::kCorridor:
      AddCorridor(CorridorLength(options), options.seed, &builder);
      break;
    case Scenario::kTwins:
      AddTwins(random, &builder);
      break;
    case Scenario::kVideo:
      AddPlainRoom(VideoRoom(options), &builder);
      break;
    case Scenario::kBlank:
      AddPlainRoom({{3.4, 2.8}, 0.75, options.seed}, &builder);
      break;
    case Scenario::kCrowd:
      AddMonumentSquare(options.seed, &builder);
      break;
    case Scenario::kSharedObject:
      AddRoomsWithOneMachine(2, options.seed, &builder);
      break;
    case Scenario::kFurniture:
      AddCanteen(options.seed, &builder);
      break;
    case Scenario::kCourtyard:
      AddCourtyard(options.seed, &builder);
      break;
    case Scenario::kStockpile:
      AddStockpile(options.seed, &builder);
      break;
    case Scenario::kSurvey:
      AddTown(SurveySize(options), options.seed, &builder);
      break;
    default:
      AddSquare({{0, 0}, random.Fork(1).Next(), random.Fork(2).Next()}, &builder);
  }
  Light light;
  light.indoors = IsIndoors(options.scenario);
  if (light.indoors) light.ambient = 1;
  return builder.Build(threads, light);
}

}  // namespace skein::sim
