// Publishes map snapshots (shapes) of submaps while somebody looks at them.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "blobs/blob_shelf.h"
#include "event_loop/alive.h"
#include "event_loop/worker_thread.h"
#include "formats/shape.h"
#include "mapper/lease.h"
#include "mapper/submap_worker.h"
#include "node/node.h"

namespace skein {

class ShapeMaker;
struct ShapeSource;

// Whether somebody looks, and when the next copy of a map may be taken: all submaps of a process
// together spend at most a fiftieth of the time on that. Loop's thread only.
class ShapeDesk {
 public:
  explicit ShapeDesk(Node& node);
  ~ShapeDesk();
  ShapeDesk(const ShapeDesk&) = delete;
  ShapeDesk& operator=(const ShapeDesk&) = delete;

  bool IsWanted() const;
  double due_s() const { return due_s_; }
  void NoteCopy(double seconds);
  // Makes chunks of copies.
  WorkerThread& maker() { return maker_; }

 private:
  PollLoop& loop_;
  Bus& bus_;
  WorkerThread maker_;
  double wanted_s_;
  double due_s_ = 0;
  Bus::SubscriptionId subscription_ = 0;
};

// The shape of one submap: made again at most once a second while it changes and somebody looks,
// and told once a second. The worker copies the map between two photos; what is made of the copy,
// on another thread, is served from memory, with what was told before it. A large map is copied
// whole every few seconds only (ShapeDesk). Meanwhile new photos come with their poses and new
// points: a copy of what they alone see. Loop's thread only.
class ShapeTeller {
 public:
  ShapeTeller(Node& node, SubmapWorker& worker, ShapeDesk& desk, const Lease& lease);
  ~ShapeTeller();
  ShapeTeller(const ShapeTeller&) = delete;
  ShapeTeller& operator=(const ShapeTeller&) = delete;

  // No shape is made from now on.
  void LeaveOut() { left_out_ = true; }
  // The map may have changed.
  void NoteChange(bool has_new_photo);
  // Once a second.
  void Tick();

 private:
  using Blobs = std::map<std::string, BlobPtr>;
  // A shape that can be told.
  struct Made {
    bool changed = false;
    double seconds = 0;  // that it took
    ShapeManifest manifest;
    std::string manifest_blob;
    int64_t manifest_bytes = 0;
    int64_t num_points = 0;
    Blobs blobs;
  };

  void MakeIfDue();
  void LookAgainAt(double due_s);
  void Make(bool whole);
  void TakeCopy(std::shared_ptr<ShapeSource> copied);
  static Made MakeBlobs(const ShapeMaker& maker, const ShapeManifest& last);
  void OnMade(Made made);
  void Publish();
  void Forget();

  Node& node_;
  SubmapWorker& worker_;
  ShapeDesk& desk_;
  const Lease lease_;
  std::shared_ptr<ShapeMaker> maker_;    // on the desk's thread while making_
  std::shared_ptr<ShapeSource> copied_;  // the last whole copy; the same
  std::vector<ImageId> copied_photos_;   // of it, ascending
  uint64_t copied_up_to_ = 0;            // highest id of a point in a whole copy
  bool changed_ = true;                  // since the last whole copy
  bool has_new_photo_ = false;           // since the last copy
  bool left_out_ = false;
  bool making_ = false;
  double look_again_s_;  // when the next timer does
  double made_s_ = 0;    // when the last copy was asked for
  double make_s_ = 0;    // how long the chunks of it took
  double wanted_s_ = 0;  // when somebody last looked
  int num_shapes_ = 0;   // since they were last wanted
  double copy_s_ = 0;    // of the worker, for these
  Made told_;
  Blobs previous_;  // of the shape before: somebody may be pulling it
  Alive alive_;
};

}  // namespace skein
