#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/clock.h"
#include "event_loop/worker_thread.h"
#include "ingest/disk_room.h"
#include "ingest/fair_queue.h"
#include "ingest/known_cameras.h"
#include "ingest/ledger_writer.h"
#include "ingest/photo_store.h"
#include "ingest/thrown_counts.h"
#include "ledger/session_folder.h"
#include "node/node.h"
#include "photo/photo_check.h"

namespace skein {

// Bounds of what an agent may leave behind; only tests have narrower ones.
struct IntakeBounds {
  double rests_after_s = 3;      // without an answer a photo yields its place to others
  double vanished_after_s = 10;  // the same: given up, once a finish was asked for
  // In the ledger, of one agent; ten times as many of all, and ten times as many duplicates.
  // Refusals and duplicates are kept for ever, a refusal goes to every process, and anybody can
  // offer without end.
  int max_refusals_agent = 1000;
};

struct IntakeOptions {
  PhotoLimits limits;
  DecoderOptions decoder;
  std::vector<KnownCamera> cameras;
  int max_pending = 64;                  // photos received at a time; more are told to wait
  int max_pending_agent = 16;            // the same, of one agent
  int64_t min_free_bytes = 512'000'000;  // on the disk, for a photo to be taken in
  IntakeBounds bounds;
};

// From an offer to a committed photo:
//  - the offer is checked;
//  - the bytes are pulled from the agent, the name is checked; the photo is whose bytes came first;
//  - one job of another thread checks, names and stores the photo; agents have equal shares of that
//    thread's time;
//  - the fact is committed.
// Every offer is answered, every time, from the ledger where it is decided. A photo is refused for
// good only when its bytes have come and their hash is right: for its name, or as no photo. Offers
// that cannot be pulled (CheckPullable) are answered, counted among the bus' refused messages, and
// leave nothing behind. A photo on which an exception comes is to be offered again, and refused for
// good after the third. Whatever else goes wrong, a later offer of it starts again. Refusals and
// duplicates have a bound in the ledger; an offer beyond it is answered again each time, and
// counted.
//
// A pull whose agent does not answer rests: it takes no place from others, keeps what has come and
// goes on when its agent is back. Beyond a bound the photo that has rested longest is forgotten.
//
// A photo whose file was lost is pulled again when its agent offers it. Photos that lie in images/
// and that no fact names are taken in as if they had been offered: what a crash, or a repair of the
// ledger, left there. Loop's thread only.
class PhotoIntake {
 public:
  // By `listened` agents are silent. Throws std::runtime_error, with a line for the user, if no
  // decoder can be started.
  PhotoIntake(Node& node, LedgerWriter& writer, SessionPaths paths, IntakeOptions options,
              Clock listened);

  void OnOffer(const image_offer_t& offer);
  // At least once a second: gives up agents that vanished, when a finish waits; takes in what lies
  // in images/.
  void Tick();

  // Includes photos that rest.
  int num_pending() const { return static_cast<int>(pending_.size()); }
  int num_duplicates() const { return static_cast<int>(duplicates_.size()); }  // that are kept
  // Why photos are not taken in, what is being received and what hangs, for a person; "" if
  // nothing.
  std::string Describe() const;
  // Why no photo is taken in, for a person; "" if photos are.
  std::string problem() const { return room_.Problem(); }

 private:
  struct Pending {
    image_offer_t offer;
    bool is_signed = false;
    int64_t received_utime_us = 0;
    BlobClient::FetchId fetch_id = 0;  // 0: no longer pulling
    int64_t received_bytes = 0;
    double progress_s = 0;  // when it last moved, or waited for its turn
    bool rests = false;
  };
  using Key = std::string;  // RefusedOfferFactId of the offer
  // Number of offers that gave no photo and that the ledger keeps.
  struct Kept {
    const int max_of_agent;
    std::map<std::string, int> of_agent = {};
    int of_all = 0;

    void Add(const std::string& agent);
    bool HasRoomFor(const std::string& agent) const;
  };

  bool AnswerDecided(const Key& key, const image_offer_t& offer);
  Status CheckPullable(const image_offer_t& offer) const;
  void CountKept();
  bool HasPlaceFor(const std::string& agent) const;
  void NoteProgress();
  void ForgetWhatRestsLongest();
  void Begin(const Key& key, const image_offer_t& offer);
  void Pull(const Key& key, Pending* pending);
  void FollowOwner(const Key& key, const image_offer_t& offer);
  void OnBytes(const Key& key, Result<Bytes> bytes);
  bool HasCome(const std::string& blob_id) const;
  template <class Job, class Then>
  void RunInTurn(const std::string& agent, Job job, Then then);
  void RunNext();
  void Store(const Key& key, Bytes bytes);
  void Restore(const Key& key, const image_t& image, Bytes bytes);
  void TakeInLeft();
  void OnLeft(const LeftPhoto& photo);
  void OnTaken(const Key& key, const Result<TakenPhoto>& taken);
  void Decide(const Key& key, const TakenPhoto& taken);
  void NoteThrown(const Key& key, const std::string& reason);
  void Commit(const Key& key, const CheckedPhoto& photo, const std::string& name);
  void NoteDuplicate(const Key& key, const std::string& agent);
  void Refuse(const Key& key, image_offer_t offer, PhotoFault fault, const std::string& reason);
  void Abandon(const Key& key, const std::string& reason);
  void GiveUp(const Key& key);

  bool IsSamePhoto(const Key& key, const image_offer_t& offer, const image_t& image) const;
  image_t MakeFact(const Pending& pending, const CheckedPhoto& photo, const std::string& name,
                   const FocalPrior& focal, int64_t camera_id, const KnownCamera* known) const;
  void Ack(const image_offer_t& offer, int8_t status, int64_t image_id,
           const std::string& reason = "", int8_t cause = failure_t::OTHER);

  Node& node_;
  LedgerWriter& writer_;
  const SessionPaths paths_;
  const IntakeOptions options_;
  const Clock listened_;
  std::map<Key, Pending> pending_;
  std::map<std::string, std::string> cameras_;     // key -> camera id
  std::map<std::string, std::string> renamed_;     // offer -> image id, of NAME~2
  std::map<std::string, std::string> duplicates_;  // offer -> agent
  Kept kept_refusals_, kept_duplicates_;
  const BlobStore blobs_;
  ThrownCounts thrown_;  // by offer
  DiskRoom room_;
  double looked_s_ = 0;         // at the disk
  int64_t num_forgotten_ = 0;   // of those that rested, the longest
  int64_t num_not_kept_ = 0;    // refusals beyond the bound
  FairJobQueue jobs_;           // by agent
  PhotoStore store_;            // the worker's
  std::vector<LeftFile> left_;  // in images/, in no fact
  WorkerThread worker_;         // last: ends first
};

}  // namespace skein
