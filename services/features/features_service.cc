#include "features/features_service.h"

#include <utility>

#include "core/attempt.h"
#include "core/clock.h"
#include "core/log.h"
#include "features/idle_cores.h"

namespace skein {

FeaturesService::FeaturesService(Node& node, const SiftOptions& sift, int max_threads,
                                 std::shared_ptr<GlobalDescriptorModel> model,
                                 std::unique_ptr<PhotoDecoder> decoder)
    : node_(node),
      max_threads_(max_threads),
      sift_(sift),
      model_(std::move(model)),
      decoder_(std::move(decoder)),
      worker_(node.loop()),
      work_(node, "features", 3, [this](const work_t& work) { OnWork(work); }),
      follower_(node, 1, [this](const Fact& fact) { OnFact(fact); }) {
  LogInfo("describes photos by {}, {} dimensions", model_->id(), model_->dim());
  node.OnHeartbeat([this](heartbeat_t* heartbeat) { FillHeartbeat(heartbeat); });
}

void FeaturesService::OnFact(const Fact& fact) {
  if (const auto* image = std::get_if<image_t>(&fact)) {
    images_[image->image_id] = *image;
    StartIfKnown(image->image_id);
  } else if (const auto* features = std::get_if<features_t>(&fact)) {
    images_.erase(features->image_id);
    described_.insert(features->image_id);
  }
}

void FeaturesService::OnWork(const work_t& work) {
  // A grant that comes when its photo is done already, here or elsewhere.
  if (described_.count(work.item_id) > 0) return work_.Done(work.item_id);
  jobs_.try_emplace(work.item_id);
  StartIfKnown(work.item_id);
}

// The ledger may be behind the work: a fact that comes later starts the job.
void FeaturesService::StartIfKnown(int64_t image_id) {
  const auto job = jobs_.find(image_id);
  const auto image = images_.find(image_id);
  if (job == jobs_.end() || image == images_.end() || job->second.started) return;
  job->second.started = true;
  job->second.computed_at_seq = follower_.processed_seq();
  node_.blobs().Fetch(image->second.blob_id, "ingest",
                      [this, image = image->second](Result<Bytes> photo) {
                        if (!photo) return Fail(image.image_id, photo.error(), false);
                        Compute(image, std::move(*photo));
                      });
}

void FeaturesService::Compute(const image_t& image, Bytes photo) {
  worker_.Run(
      [this, image, photo = std::move(photo)] {
        return Attempt([&] { return Describe(image, photo); });
      },
      [this, id = image.image_id](const Result<Described>& described) {
        OnDescribed(id, described);
      });
}

// Ingest counts an exception, and parks the photo after three.
void FeaturesService::OnDescribed(int64_t image_id, const Result<Described>& described) {
  Status status = described.status();
  if (status.ok()) status = Attempt([&] { Submit(image_id, *described); });
  if (!status.ok()) Fail(image_id, status.error(), status.code != StatusCode::kUnavailable);
}

Result<FeaturesService::Described> FeaturesService::Describe(const image_t& image,
                                                             const Bytes& photo) {
  const Timer timer;
  auto result =
      DescribePhoto(decoder_.get(), photo, image.width_px, image.height_px, image.orientation,
                    &sift_, ThreadsForIdleCores(max_threads_), model_.get());
  if (!result.ok()) return result.status();
  Described described;
  described.photo = std::move(*result);
  const PhotoDescription& of = described.photo;
  described.blobs.keypoints = node_.blobs().Offer(EncodeKeypoints(of.local.keypoints));
  described.blobs.descriptors = node_.blobs().Offer(EncodeDescriptors(of.local.descriptors));
  described.blobs.global = node_.blobs().Offer(EncodeGlobalDescriptor(of.global));
  described.elapsed_s = timer.ElapsedS();
  return described;
}

void FeaturesService::Submit(int64_t image_id, const Described& described) {
  ++num_done_;
  sum_elapsed_s_ += described.elapsed_s;
  LogDebug("image {}: {} keypoints, {:.2f} s local, {:.2f} s global", image_id,
           described.photo.local.keypoints.size(), described.photo.local_s,
           described.photo.global_s);
  node_.submitter().Submit(
      ToMessage(image_id, jobs_.at(image_id).computed_at_seq, described.photo, described.blobs),
      [this, image_id](const Submission& done) {
        if (!done.committed()) return Fail(image_id, done.reason, true);
        jobs_.erase(image_id);
        work_.Done(image_id);
      });
}

void FeaturesService::Fail(int64_t image_id, const std::string& reason, bool permanent) {
  LogWarn("image {}: {}", image_id, reason);
  jobs_.erase(image_id);
  work_.Fail(image_id, reason, permanent);
}

void FeaturesService::FillHeartbeat(heartbeat_t* heartbeat) const {
  heartbeat->state = jobs_.empty() ? "idle" : "computing";
  heartbeat->backlog = static_cast<int32_t>(jobs_.size());
  heartbeat->num_done = num_done_;
  heartbeat->mean_s = num_done_ > 0 ? static_cast<float>(sum_elapsed_s_ / num_done_) : 0;
}

}  // namespace skein
