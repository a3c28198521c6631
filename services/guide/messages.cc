#include "guide/messages.h"

#include "core/finite.h"
#include "ledger/facts.h"

namespace skein {
namespace {

constexpr size_t kSentenceBytes = 240;

station_t ToMessage(const AdvisedStation& advised) {
  const Station& station = advised.station;
  const Eigen::Quaterniond& rotation = station.cam_from_world.rotation;
  station_t message{};
  message.cam_from_world_qwxyz[0] = static_cast<float>(rotation.w());
  message.cam_from_world_qwxyz[1] = static_cast<float>(rotation.x());
  message.cam_from_world_qwxyz[2] = static_cast<float>(rotation.y());
  message.cam_from_world_qwxyz[3] = static_cast<float>(rotation.z());
  for (int i = 0; i < 3; ++i) {
    message.cam_from_world_xyz[i] = static_cast<float>(station.cam_from_world.translation[i]);
    message.target[i] = static_cast<float>(station.target[i]);
  }
  message.gain = static_cast<float>(station.gain);
  message.common_points = static_cast<float>(station.common_points);
  message.why = static_cast<int8_t>(station.why);
  message.nearest_image_id = advised.nearest_image_id;
  message.right = static_cast<float>(advised.offset.x());
  message.down = static_cast<float>(advised.offset.y());
  message.forward = static_cast<float>(advised.offset.z());
  message.sentence = ClampText(advised.sentence, kSentenceBytes);
  return message;
}

}  // namespace

guidance_t ToMessage(const PlaceGuidance& guidance) {
  guidance_t message{};
  SetCompleteness(guidance.place, guidance.metres_per_unit, &message.place);
  message.submap_id = guidance.submap_id;
  message.version = static_cast<int64_t>(guidance.version);
  return message;
}

advice_t ToMessage(const PlaceGuidance& guidance, const AgentAdvice& advice) {
  advice_t message{};
  message.agent = advice.agent;
  message.submap_id = guidance.submap_id;
  message.version = static_cast<int64_t>(guidance.version);
  message.last_image_id = advice.last_image_id;
  message.working_distance = FiniteOrZero(guidance.working_distance);
  message.metres_per_unit = FiniteOrZero(guidance.metres_per_unit);
  for (const AdvisedStation& station : advice.stations) {
    message.stations.push_back(ToMessage(station));
    message.num_stations = static_cast<int32_t>(message.stations.size());
    if (message.getEncodedSize() <= kMaxAdviceBytes) continue;
    message.stations.pop_back();
    message.num_stations = static_cast<int32_t>(message.stations.size());
    break;
  }
  return message;
}

}  // namespace skein
