// Every channel: its name and its one type. docs/channels.md says who sends what to whom and when.
#pragma once

#include <string>

#include "skein/advice_t.hpp"
#include "skein/blob_chunk_t.hpp"
#include "skein/blob_request_t.hpp"
#include "skein/candidates_t.hpp"
#include "skein/command_reply_t.hpp"
#include "skein/command_t.hpp"
#include "skein/configuration_t.hpp"
#include "skein/demand_t.hpp"
#include "skein/failure_t.hpp"
#include "skein/features_t.hpp"
#include "skein/finish_t.hpp"
#include "skein/guidance_t.hpp"
#include "skein/heartbeat_t.hpp"
#include "skein/image_ack_t.hpp"
#include "skein/image_offer_t.hpp"
#include "skein/image_t.hpp"
#include "skein/ledger_head_t.hpp"
#include "skein/ledger_range_t.hpp"
#include "skein/ledger_request_t.hpp"
#include "skein/matches_t.hpp"
#include "skein/merge_t.hpp"
#include "skein/photo_diagnosis_t.hpp"
#include "skein/registration_t.hpp"
#include "skein/seed_t.hpp"
#include "skein/shape_wanted_t.hpp"
#include "skein/shared_reply_t.hpp"
#include "skein/shared_request_t.hpp"
#include "skein/submap_end_t.hpp"
#include "skein/submap_lease_t.hpp"
#include "skein/submap_model_t.hpp"
#include "skein/submap_shape_t.hpp"
#include "skein/submap_status_t.hpp"
#include "skein/submit_reply_t.hpp"
#include "skein/work_failed_t.hpp"
#include "skein/work_request_t.hpp"
#include "skein/work_t.hpp"

namespace skein {

// LCM takes a subscription's channel for a regular expression: names hold A-Z, 0-9 and _ only.
template <class T>
struct Channel {
  const char* name;
};

// Committed facts, broadcast by ingest. A LedgerFollower makes a gapless sequence of them.
inline constexpr Channel<image_t> kImageChannel{"SKEIN_IMAGE"};
inline constexpr Channel<features_t> kFeaturesChannel{"SKEIN_FEATURES"};
inline constexpr Channel<candidates_t> kCandidatesChannel{"SKEIN_CANDIDATES"};
inline constexpr Channel<matches_t> kMatchesChannel{"SKEIN_MATCHES"};
inline constexpr Channel<registration_t> kRegistrationChannel{"SKEIN_REGISTRATION"};
inline constexpr Channel<submap_lease_t> kSubmapLeaseChannel{"SKEIN_SUBMAP_LEASE"};
inline constexpr Channel<submap_model_t> kSubmapModelChannel{"SKEIN_SUBMAP_MODEL"};
inline constexpr Channel<submap_end_t> kSubmapEndChannel{"SKEIN_SUBMAP_END"};
inline constexpr Channel<seed_t> kSeedChannel{"SKEIN_SEED"};
inline constexpr Channel<merge_t> kMergeChannel{"SKEIN_MERGE"};
inline constexpr Channel<failure_t> kFailureChannel{"SKEIN_FAILURE"};
inline constexpr Channel<finish_t> kFinishChannel{"SKEIN_FINISH"};
inline constexpr Channel<configuration_t> kConfigurationChannel{"SKEIN_CONFIGURATION"};

// Submissions to ingest; a Submitter repeats them until they are answered.
inline constexpr Channel<image_t> kSubmitImageChannel{"SKEIN_SUBMIT_IMAGE"};
inline constexpr Channel<features_t> kSubmitFeaturesChannel{"SKEIN_SUBMIT_FEATURES"};
inline constexpr Channel<candidates_t> kSubmitCandidatesChannel{"SKEIN_SUBMIT_CANDIDATES"};
inline constexpr Channel<matches_t> kSubmitMatchesChannel{"SKEIN_SUBMIT_MATCHES"};
inline constexpr Channel<registration_t> kSubmitRegistrationChannel{"SKEIN_SUBMIT_REGISTRATION"};
inline constexpr Channel<submap_lease_t> kSubmitSubmapLeaseChannel{"SKEIN_SUBMIT_SUBMAP_LEASE"};
inline constexpr Channel<submap_model_t> kSubmitSubmapModelChannel{"SKEIN_SUBMIT_SUBMAP_MODEL"};
inline constexpr Channel<submap_end_t> kSubmitSubmapEndChannel{"SKEIN_SUBMIT_SUBMAP_END"};
inline constexpr Channel<seed_t> kSubmitSeedChannel{"SKEIN_SUBMIT_SEED"};
inline constexpr Channel<merge_t> kSubmitMergeChannel{"SKEIN_SUBMIT_MERGE"};
inline constexpr Channel<failure_t> kSubmitFailureChannel{"SKEIN_SUBMIT_FAILURE"};
inline constexpr Channel<finish_t> kSubmitFinishChannel{"SKEIN_SUBMIT_FINISH"};
inline constexpr Channel<configuration_t> kSubmitConfigurationChannel{"SKEIN_SUBMIT_CONFIGURATION"};
inline constexpr Channel<submit_reply_t> kSubmitReplyChannel{"SKEIN_SUBMIT_REPLY"};

inline constexpr Channel<image_offer_t> kImageOfferChannel{"SKEIN_IMAGE_OFFER"};
inline constexpr Channel<image_ack_t> kImageAckChannel{"SKEIN_IMAGE_ACK"};
inline constexpr Channel<photo_diagnosis_t> kPhotoDiagnosisChannel{"SKEIN_PHOTO_DIAGNOSIS"};

inline constexpr Channel<ledger_head_t> kLedgerHeadChannel{"SKEIN_LEDGER_HEAD"};
inline constexpr Channel<ledger_request_t> kLedgerRequestChannel{"SKEIN_LEDGER_REQUEST"};
inline constexpr Channel<ledger_range_t> kLedgerRangeChannel{"SKEIN_LEDGER_RANGE"};

inline constexpr Channel<work_request_t> kWorkRequestChannel{"SKEIN_WORK_REQUEST"};
inline constexpr Channel<work_t> kWorkChannel{"SKEIN_WORK"};
inline constexpr Channel<work_failed_t> kWorkFailedChannel{"SKEIN_WORK_FAILED"};
inline constexpr Channel<demand_t> kDemandChannel{"SKEIN_DEMAND"};

inline constexpr Channel<submap_status_t> kSubmapStatusChannel{"SKEIN_SUBMAP_STATUS"};
inline constexpr Channel<submap_shape_t> kSubmapShapeChannel{"SKEIN_SUBMAP_SHAPE"};
inline constexpr Channel<shape_wanted_t> kShapeWantedChannel{"SKEIN_SHAPE_WANTED"};
inline constexpr Channel<guidance_t> kGuidanceChannel{"SKEIN_GUIDANCE"};
inline constexpr Channel<advice_t> kAdviceChannel{"SKEIN_ADVICE"};
inline constexpr Channel<shared_request_t> kSharedRequestChannel{"SKEIN_SHARED_REQUEST"};
inline constexpr Channel<shared_reply_t> kSharedReplyChannel{"SKEIN_SHARED_REPLY"};

inline constexpr Channel<heartbeat_t> kHeartbeatChannel{"SKEIN_HEARTBEAT"};
// heartbeat_t.state of a process that leaves as it was told to: its last one.
inline constexpr char kEndedState[] = "ended";
inline constexpr Channel<command_t> kCommandChannel{"SKEIN_COMMAND"};
inline constexpr Channel<command_reply_t> kCommandReplyChannel{"SKEIN_COMMAND_REPLY"};

inline constexpr Channel<blob_request_t> kBlobRequestChannel{"SKEIN_BLOB_REQUEST"};

// Channel of the chunks for one instance, on the bulk bus: SKEIN_BLOB_CHUNK_<INSTANCE>, in the
// letters and the length (63) that LCM takes. Two instances may share one: chunks name their blob.
std::string BlobChunkChannel(const std::string& instance);

// The instance under which an agent serves its photos. The instance is the same for every run, so
// an interrupted pull goes on. At most 64 letters, digits and hyphens.
std::string AgentInstance(const std::string& agent);

}  // namespace skein
