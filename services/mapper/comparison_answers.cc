#include "mapper/comparison_answers.h"

#include <algorithm>
#include <string>
#include <utility>

#include "core/log.h"
#include "formats/formats.h"
#include "mapper/submap_run.h"
#include "session/submap_steps.h"
#include "skein/shared_reply_t.hpp"

namespace skein {

// A map that is behind its ledger gives no answer: after a restart it may yet have to place what
// the asker knows of, and a photo that is not through matching would be loaded without its pairs.
bool ComparisonAnswers::MayAnswer(const std::vector<int64_t>& image_ids) const {
  const SubmapLife& submap = *session_.FindSubmap(run_.submap_id());
  return std::all_of(image_ids.begin(), image_ids.end(), [&](int64_t id) {
    const PhotoState* photo = session_.FindPhoto(id);
    return photo != nullptr && photo->through_matching() &&
           (run_.IsRegistered(id) || !submap.IsRegistered(id));
  });
}

void ComparisonAnswers::Answer(const shared_request_t& request) {
  if (answering_ || !MayAnswer(request.image_ids)) return;
  const std::string step = ComparisonStep(request.other_submap_id);
  if (run_.IsLeftOut(step)) return Reply(request.request_id, EncodeSharedImages({}));
  answering_ = true;
  photos_.Load(request.image_ids, [this, step, ids = request.image_ids,
                                   request_id = request.request_id](const FetchedPhotos& photos) {
    run_.RunOnWorker(
        step,
        [photos, ids](Submap& submap) {
          const Status added = AddToSubmap(photos, &submap);
          if (!added.ok()) LogWarn("a photo that cannot be compared: {}", added.error());
          return EncodeSharedImages(submap.ExportShared(ids));
        },
        [this, request_id](Bytes shared) { Reply(request_id, std::move(shared)); });
  });
}

void ComparisonAnswers::Reply(int64_t request_id, Bytes shared) {
  answering_ = false;
  shared_reply_t reply{};
  reply.request_id = request_id;
  reply.submap_id = run_.submap_id();
  reply.epoch = run_.epoch();
  reply.owner = node_.instance();
  reply.blob_id = node_.blobs().Serve(std::move(shared));
  reply.ledger_seq = run_.told_seq();
  node_.Publish(kSharedReplyChannel, reply);
}

}  // namespace skein
