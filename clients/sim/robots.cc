#include "clients/sim/robots.h"

#include <algorithm>
#include <iostream>
#include <utility>

#include "geometry/pose_evaluation.h"

namespace skein::sim {
namespace {

constexpr double kTickS = 0.2;
// Without advice on its last photo for so long, a robot follows earlier advice.
constexpr double kPatienceS = 15;
constexpr double kClearanceM = 0.5;
// Two viewpoints are one if both differences are smaller.
constexpr double kSameM = 0.3, kSameRad = 0.15;

CameraPose ToCameraPose(const Pose& pose) { return {pose.cam_from_world, pose.Translation()}; }
Pose ToPose(const CameraPose& pose) { return {pose.rotation, pose.Centre()}; }

// `message`: a registration_t or a station_t.
template <class Message>
CameraPose PoseOf(const Message& message) {
  const auto* q = message.cam_from_world_qwxyz;
  const auto* t = message.cam_from_world_xyz;
  return {Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized(), {t[0], t[1], t[2]}};
}

bool IsSame(const Pose& a, const Pose& b) {
  return (a.center - b.center).norm() < kSameM &&
         a.cam_from_world.angularDistance(b.cam_from_world) < kSameRad;
}

}  // namespace

Robots::Robots(Node& node, const SimOptions& sim, const RobotOptions& options, const Place& place,
               TakePhoto take)
    : node_(node),
      sim_(sim),
      options_(options),
      place_(place),
      take_(std::move(take)),
      follower_(node, 1, [this](const Fact& fact) { OnFact(fact); }) {
  SimOptions walk = sim;
  walk.scenario.photos = options.first_photos;
  plan_ = PlanCaptures(walk, place);
  for (int i = 0; i < sim.scenario.agents; ++i) {
    robots_.emplace_back();
    robots_.back().name = plan_.captures[i].agent;
    robots_.back().index = i;
  }
  subscriptions_.push_back(
      node_.bus().Subscribe(kAdviceChannel, [this](const advice_t& advice) { OnAdvice(advice); }));
  subscriptions_.push_back(node_.bus().Subscribe(
      kGuidanceChannel, [this](const guidance_t& guidance) { OnGuidance(guidance); }));
  timer_ = node_.loop().AddTimer(kTickS, [this] { Tick(); });
}

Robots::~Robots() {
  node_.loop().CancelTimer(timer_);
  for (const Bus::SubscriptionId id : subscriptions_) node_.bus().Unsubscribe(id);
}

bool Robots::done() const {
  return std::all_of(robots_.begin(), robots_.end(), [this](const Robot& robot) {
    const bool given_up = node_.loop().now_s() - robot.taken_s > 4 * kPatienceS;
    return robot.is_done && (LastImage(robot) != 0 || given_up);
  });
}

std::string Robots::Summary() const {
  std::string text;
  for (const Robot& robot : robots_) {
    text +=
        robot.name + ": " + std::to_string(robot.num_taken) + " photos; " + robot.why_done + "\n";
  }
  return text;
}

void Robots::OnFact(const Fact& fact) {
  state_.Apply(fact);
  const auto* registration = std::get_if<registration_t>(&fact);
  if (registration == nullptr || registration->state != registration_t::REGISTERED) return;
  submap_poses_[registration->submap_id][registration->image_id] = PoseOf(*registration);
}

void Robots::OnAdvice(const advice_t& advice) {
  for (Robot& robot : robots_) {
    if (robot.name == advice.agent) robot.advice = advice;
  }
}

void Robots::OnGuidance(const guidance_t& guidance) { guidance_[guidance.submap_id] = guidance; }

void Robots::Tick() {
  for (Robot& robot : robots_) {
    if (!robot.is_done) Move(&robot);
  }
}

void Robots::Move(Robot* robot) {
  const auto end = [&](const std::string& why) {
    robot->is_done = true;
    robot->why_done = why;
  };
  if (robot->num_taken < options_.first_photos) {
    const int agents = static_cast<int>(robots_.size());
    return Take(robot, plan_.captures[robot->num_taken * agents + robot->index]);
  }
  if (robot->num_taken >= options_.max_photos) return end("as many as it may take");
  const double waited_s = node_.loop().now_s() - robot->taken_s;
  if (!robot->advice || (!IsSettled(*robot) && waited_s < kPatienceS)) {
    if (waited_s > 4 * kPatienceS) end("nobody advises it");
    return;
  }
  const auto guidance = guidance_.find(robot->advice->submap_id);
  if (guidance != guidance_.end() && guidance->second.place.verdict == completeness_t::COMPLETE) {
    return end("the place is complete: " + guidance->second.place.sentence);
  }
  // Advice on the same photo may still change: the map is adjusted.
  if (!FollowAdvice(robot) && waited_s > kPatienceS) {
    end("nothing is left that it can reach");
  }
}

// Its last photo is in the map, and in the advice; or it will not come into the map.
bool Robots::IsSettled(const Robot& robot) const {
  const int64_t image_id = LastImage(robot);
  if (image_id == 0) return false;
  return robot.advice->last_image_id == image_id;
}

int64_t Robots::LastImage(const Robot& robot) const {
  for (auto photo = state_.photos().rbegin(); photo != state_.photos().rend(); ++photo) {
    const image_t& image = photo->second.image;
    if (image.agent == robot.name && image.name == robot.last_file) return photo->first;
  }
  return 0;
}

std::optional<Similarity> Robots::PlaceFromSubmap(int64_t submap_id) const {
  const auto poses = submap_poses_.find(submap_id);
  if (poses == submap_poses_.end()) return std::nullopt;
  std::vector<PosePair> pairs;
  for (const auto& [image_id, pose] : poses->second) {
    const auto known = true_poses_.find(state_.NameOf(image_id));
    if (known != true_poses_.end()) pairs.push_back({known->first, pose, known->second});
  }
  bool by_orientation = false;
  const Result<Similarity> similarity = AlignPoses(pairs, &by_orientation);
  if (!similarity.ok()) return std::nullopt;
  return *similarity;
}

// Not within arm's length of a surface, nor below the ground.
bool Robots::MayStandAt(const Eigen::Vector3d& centre) const {
  const Eigen::Vector3f origin = centre.cast<float>();
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        if (x == 0 && y == 0 && z == 0) continue;
        const Eigen::Vector3f ray = Eigen::Vector3f(x, y, z).normalized();
        if (place_.scene.Occluded(origin, ray, static_cast<float>(kClearanceM))) return false;
      }
    }
  }
  return place_.scene.Trace(origin, -Eigen::Vector3f::UnitZ()).surface >= 0;
}

bool Robots::FollowAdvice(Robot* robot) {
  const advice_t& advice = *robot->advice;
  const std::optional<Similarity> to_place = PlaceFromSubmap(advice.submap_id);
  if (!to_place) return true;  // not yet
  for (const station_t& station : advice.stations) {
    const Pose pose = ToPose(TransformPose(*to_place, PoseOf(station)));
    const bool was_there = std::any_of(robot->stations.begin(), robot->stations.end(),
                                       [&](const Pose& other) { return IsSame(pose, other); });
    if (was_there || !MayStandAt(pose.center)) continue;
    robot->stations.push_back(pose);
    std::cout << robot->name << ": " << station.sentence << std::endl;
    Take(robot, CaptureAt(sim_, plan_.cameras, robot->index, robot->name, robot->num_taken, pose));
    return true;
  }
  return false;
}

void Robots::Take(Robot* robot, const Capture& capture) {
  true_poses_[capture.agent + "/" + capture.file] = ToCameraPose(capture.shot.pose);
  taken_.push_back(capture);
  robot->last_file = capture.file;
  robot->taken_s = node_.loop().now_s();
  ++robot->num_taken;
  take_(capture, plan_.cameras[capture.camera]);
}

}  // namespace skein::sim
