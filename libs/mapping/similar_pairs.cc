#include "mapping/similar_pairs.h"

#include "disambiguation/similar_structures.h"

namespace skein {

bool AreOfSimilarStructures(const RegistrationOptions& options, const SceneMap& map,
                            const std::vector<std::pair<ImageId, ImageId>>& pairs) {
  CellVotes votes;
  for (const auto& [id, other] : pairs) {
    const auto pose = EstimatePoseByPair(options, map, id, other);
    if (pose) votes.Add(CompareWithPhoto(options.similar_structures, map, id, *pose, other));
  }
  return ShowsAnotherPlace(options.similar_structures, votes);
}

}  // namespace skein
