#include "mapping/guest_photos.h"

namespace skein {

GuestPhotos::~GuestPhotos() {
  for (auto trial = trials_.rbegin(); trial != trials_.rend(); ++trial) trial->Undo();
}

void GuestPhotos::Place(ImageId id, const TrialContext& context, FoundPoses* found) {
  trials_.emplace_back(context, id, &map_);
  PhotoTrial& trial = trials_.back();
  bool stands = trial.FindPose(found);
  if (stands) {
    trial.Place();
    stands = trial.Judge().decision == Verdict::Decision::kKeep;
    if (!stands) trial.Undo();
  }
  if (!stands) trials_.pop_back();
}

}  // namespace skein
