#include "mapping/similar_pairs.h"

#include "disambiguation/similar_structures.h"

namespace skein {

bool AreOfSimilarStructures(const SceneMap& map,
                            const std::vector<std::pair<ImageId, ImageId>>& pairs, int min_cells) {
  CellVotes votes;
  for (const auto& [id, other] : pairs) {
    const auto pose = EstimatePoseByPair(map, id, other);
    if (pose) votes.Add(CompareWithPhoto(map, id, *pose, other));
  }
  return ShowsAnotherPlace(votes, min_cells);
}

}  // namespace skein
