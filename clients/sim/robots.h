// Robots that photograph a synthetic place as the session's guide advises them (advice_t).
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "clients/places/place.h"
#include "clients/sim/capture.h"
#include "geometry/sim3_similarity.h"
#include "node/ledger_follower.h"
#include "node/node.h"
#include "session/session_state.h"

namespace skein::sim {

struct RobotOptions {
  int first_photos = 5;  // of its walk, before it follows advice
  int max_photos = 100;  // of each robot
};

// A photo is to be rendered and handed to its agent.
using TakePhoto = std::function<void(const Capture& capture, const Camera& camera)>;

// Each robot takes a few photos of its walk, then goes where advice_t sends it. A robot knows its
// own true poses, as odometry would tell it, and the poses of registration_t. The similarity
// between both leads from the submap to the place. A viewpoint where no camera fits (it has a sense
// of distance) is left out. A robot ends when guidance_t says that its submap is complete, when it
// has nothing to do that it has not done, or after max_photos. Loop's thread only.
class Robots {
 public:
  Robots(Node& node, const SimOptions& sim, const RobotOptions& options, const Place& place,
         TakePhoto take);
  ~Robots();
  Robots(const Robots&) = delete;
  Robots& operator=(const Robots&) = delete;

  bool done() const;
  const std::vector<Camera>& cameras() const { return plan_.cameras; }
  const std::vector<Capture>& taken() const { return taken_; }
  // A line for each robot: photos, and why it ended.
  std::string Summary() const;

 private:
  struct Robot {
    std::string name;
    int index = 0;
    int num_taken = 0;
    std::string last_file;
    double taken_s = 0;
    std::vector<Pose> stations;  // where it was sent
    std::optional<advice_t> advice;
    bool is_done = false;
    std::string why_done;
  };

  void OnFact(const Fact& fact);
  void OnAdvice(const advice_t& advice);
  void OnGuidance(const guidance_t& guidance);
  void Tick();
  void Move(Robot* robot);
  bool FollowAdvice(Robot* robot);
  bool IsSettled(const Robot& robot) const;
  int64_t LastImage(const Robot& robot) const;
  std::optional<Similarity> PlaceFromSubmap(int64_t submap_id) const;
  bool MayStandAt(const Eigen::Vector3d& centre) const;
  void Take(Robot* robot, const Capture& capture);

  Node& node_;
  const SimOptions sim_;
  const RobotOptions options_;
  const Place& place_;
  const TakePhoto take_;
  CapturePlan plan_;
  std::vector<Robot> robots_;
  std::vector<Capture> taken_;
  std::map<std::string, CameraPose> true_poses_;                   // by AGENT/NAME
  std::map<int64_t, std::map<int64_t, CameraPose>> submap_poses_;  // by submap and image
  std::map<int64_t, guidance_t> guidance_;                         // by submap
  SessionState state_;
  LedgerFollower follower_;
  std::vector<Bus::SubscriptionId> subscriptions_;
  PollLoop::TimerId timer_ = 0;
};

}  // namespace skein::sim
