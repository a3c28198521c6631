// Every channel: its name and its one type. docs/channels.md says who sends what to whom and when.
#pragma once

#include <string>

#include "skein/all_types.h"

namespace skein {

// LCM takes a subscription's channel for a regular expression: names hold A-Z, 0-9 and _ only.
template <class T>
struct Channel {
  const char* name;
};

// Every kind of fact, in the order of its number: the name of its type and of its constants, the
// channel where ingest broadcasts committed ones, the channel of submissions to ingest. A new kind
// is the last row: the order is part of the ledger range format (ledger/ledger_range.h), and any
// other change raises that format's version.
#define SKEIN_FACT_KINDS(X)                                                        \
  X(image, Image, "SKEIN_IMAGE", "SKEIN_SUBMIT_IMAGE")                             \
  X(features, Features, "SKEIN_FEATURES", "SKEIN_SUBMIT_FEATURES")                 \
  X(candidates, Candidates, "SKEIN_CANDIDATES", "SKEIN_SUBMIT_CANDIDATES")         \
  X(matches, Matches, "SKEIN_MATCHES", "SKEIN_SUBMIT_MATCHES")                     \
  X(seed, Seed, "SKEIN_SEED", "SKEIN_SUBMIT_SEED")                                 \
  X(submap_lease, SubmapLease, "SKEIN_SUBMAP_LEASE", "SKEIN_SUBMIT_SUBMAP_LEASE")  \
  X(registration, Registration, "SKEIN_REGISTRATION", "SKEIN_SUBMIT_REGISTRATION") \
  X(submap_model, SubmapModel, "SKEIN_SUBMAP_MODEL", "SKEIN_SUBMIT_SUBMAP_MODEL")  \
  X(submap_end, SubmapEnd, "SKEIN_SUBMAP_END", "SKEIN_SUBMIT_SUBMAP_END")          \
  X(merge, Merge, "SKEIN_MERGE", "SKEIN_SUBMIT_MERGE")                             \
  X(failure, Failure, "SKEIN_FAILURE", "SKEIN_SUBMIT_FAILURE")                     \
  X(finish, Finish, "SKEIN_FINISH", "SKEIN_SUBMIT_FINISH")                         \
  X(configuration, Configuration, "SKEIN_CONFIGURATION", "SKEIN_SUBMIT_CONFIGURATION")

// kImageChannel ... kConfigurationChannel: a LedgerFollower makes a gapless sequence of these
// facts. kSubmitImageChannel ... kSubmitConfigurationChannel: a Submitter repeats until it is
// answered.
#define SKEIN_FACT_CHANNELS(type, Name, COMMITTED, SUBMITTED)     \
  inline constexpr Channel<type##_t> k##Name##Channel{COMMITTED}; \
  inline constexpr Channel<type##_t> kSubmit##Name##Channel{SUBMITTED};
SKEIN_FACT_KINDS(SKEIN_FACT_CHANNELS)
#undef SKEIN_FACT_CHANNELS

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
inline constexpr Channel<dense_points_t> kDensePointsChannel{"SKEIN_DENSE_POINTS"};
inline constexpr Channel<guidance_t> kGuidanceChannel{"SKEIN_GUIDANCE"};
inline constexpr Channel<advice_t> kAdviceChannel{"SKEIN_ADVICE"};
inline constexpr Channel<shared_request_t> kSharedRequestChannel{"SKEIN_SHARED_REQUEST"};
inline constexpr Channel<shared_reply_t> kSharedReplyChannel{"SKEIN_SHARED_REPLY"};

inline constexpr Channel<heartbeat_t> kHeartbeatChannel{"SKEIN_HEARTBEAT"};
// heartbeat_t.state of a process that leaves as it was told to: its last one.
inline constexpr char kEndedState[] = "ended";
inline constexpr Channel<command_t> kCommandChannel{"SKEIN_COMMAND"};
inline constexpr Channel<command_reply_t> kCommandReplyChannel{"SKEIN_COMMAND_REPLY"};

// Channels for one instance: the prefix and the instance's name, in the letters and the length (63)
// that LCM takes. Two instances may share one: requests name the owner, chunks their blob.
inline constexpr char kBlobRequestPrefix[] = "SKEIN_BLOB_REQUEST_";
inline constexpr char kBlobChunkPrefix[] = "SKEIN_BLOB_CHUNK_";
// Requests for blobs that the instance owns: blob_request_t, on the main bus.
std::string BlobRequestChannel(const std::string& instance);
// Chunks that the instance asked for: blob_chunk_t, on the bulk bus.
std::string BlobChunkChannel(const std::string& instance);

// The instance under which an agent serves its photos. The instance is the same for every run, so
// an interrupted pull goes on. At most 64 letters, digits and hyphens.
std::string AgentInstance(const std::string& agent);

}  // namespace skein
