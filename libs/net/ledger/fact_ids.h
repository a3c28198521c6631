#pragma once

// Every fact_id there is. A fact_id is its fact's idempotence key: what must be in the ledger
// once has one id, whoever submits it and however often.

#include <cstdint>
#include <string>

namespace skein {

// "configuration/INSTANCE/HASH", of service, version and text: what did not change is told once.
std::string ConfigurationFactId(const std::string& instance, const std::string& service,
                                const std::string& version, const std::string& text);
std::string ImageFactId(const std::string& blob_id);  // "image/BLOB"
// "refused/HASH": one refusal for each agent, name and content of an offer.
std::string RefusedOfferFactId(const std::string& agent, const std::string& name,
                               const std::string& blob_id);
// "vanished/BLOB/FINISH": the agent fell silent while the photo was pulled.
std::string VanishedAgentFactId(const std::string& blob_id, int64_t finish_id);
std::string VanishedAgentPrefix();  // "vanished/"

std::string FeaturesFactId(int64_t image_id);    // "features/IMAGE"
std::string CandidatesFactId(int64_t image_id);  // "candidates/IMAGE"
std::string MatchesFactId(int64_t image_id);     // "matches/IMAGE"
// "registration/IMAGE/SUBMAP/EPOCH/N", n counting the photo's facts from the ledger's head where
// the mapper began: a mapper that was restarted within an epoch takes no id of its predecessor.
std::string RegistrationFactId(int64_t image_id, int64_t submap_id, int64_t epoch, int64_t n);

// "seed/IMAGE-IMAGE", whichever photo comes first: a pair is seeded once.
std::string SeedFactId(int64_t image_id1, int64_t image_id2);
std::string SubmapLeaseFactId(int64_t submap_id, int64_t epoch);  // "submap/ID/EPOCH/lease"
// "submap/ID/EPOCH/model/N", n rising from the ledger's head, as a registration's.
std::string SubmapModelFactId(int64_t submap_id, int64_t epoch, int64_t n);
std::string SubmapEndFactId(int64_t submap_id);  // "submap/ID/end": a submap ends once

// "merge/SOURCE-TARGET/NUM_IMAGES/DRAINED/ordered", or failed: names the attempt by its evidence,
// so that a restarted merger cannot order it twice.
std::string MergeAttemptFactId(int64_t source_id, int64_t target_id, int num_images,
                               int64_t drained_seq, bool ordered);
std::string MergeFrozenFactId(int64_t merge_id, int64_t epoch);  // "merge/ID/frozen/EPOCH"
std::string MergeEndFactId(int64_t merge_id, int64_t epoch);     // "merge/ID/end/EPOCH"

// "failure/KIND/ITEM/ATTEMPTS": of an item of work.
std::string FailureFactId(const std::string& kind, int64_t item, int attempts);
// "failure/submap/ID/STEP/CAUSE": one failure of a step. `cause`: the life or the epoch it ended.
std::string FailedStepFactId(int64_t submap_id, const std::string& step, const std::string& cause);
// "finish/requested/COMMAND": REQUESTED or DEADLINE, whichever the command came to.
std::string FinishRequestFactId(int64_t command_id);
// "finish/ID/drained" and so on; state: finish_t's others.
std::string FinishFactId(int64_t finish_id, int8_t state);

}  // namespace skein
