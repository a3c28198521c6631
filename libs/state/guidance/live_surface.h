// A surface that follows a map: an update recomputes only what has changed. Inside of
// libs/state/guidance.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "guidance/borders.h"
#include "guidance/place_scale.h"
#include "guidance/point_cells.h"
#include "guidance/sights.h"
#include "guidance/surface.h"

namespace skein {

// Tolerance and scale of values that are held from update to update (live_place.h).
struct Holding {
  double tolerance = 0.1;
  std::optional<PlaceScale> scale = std::nullopt;  // not measured then
};

// Writes to `surface` what MakeSurface makes of each map, but for what is held (live_place.h). The
// first update is MakeSurface. Surfels and parts keep their index while they live.
class LiveSurface {
 public:
  LiveSurface(const Holding& holding, Surface* surface)
      : tolerance_(holding.tolerance), given_scale_(holding.scale), surface_(*surface) {}

  // A surfel or part that came, went, or changed, but for its border.
  struct Change {
    uint32_t index = 0;
    // Photos that came to those that see the surfel or part, if nothing else changed.
    std::optional<std::vector<uint32_t>> came;
  };
  // By the last update. Lists are ascending.
  struct Changes {
    bool all = false;  // everything is recomputed, and has other indices
    std::vector<Change> surfels, parts;
    // By photo: new or moved, or it observes other points.
    std::vector<bool> other_observations;
    // By photo: another pose, camera or texture than before.
    std::vector<bool> moved;
  };

  // As LivePlace::Update takes maps.
  void Update(const GuidedMap& map);

  const std::vector<Surfel>& parts() const { return parts_.surfels; }
  // Index of the surfel that holds each part.
  const std::vector<uint32_t>& whole_of() const { return whole_of_; }
  double part_width() const { return scale_.part_cell; }
  bool IsGround(const Surfel& part) const { return skein::IsGround(part, up_, looks_ahead_); }
  const Changes& changes() const { return changes_; }
  // As it is held.
  const GuidedMap& map() const { return map_; }

 private:
  // Surfels in cells of one width. Changes of an update are flagged by surfel.
  struct Population {
    static constexpr uint32_t kNone = PointCells::kNone;

    PointCells cells;
    std::vector<Surfel> surfels;    // of the wholes these are in surface_
    std::vector<uint32_t> of_cell;  // kNone: none
    std::vector<uint32_t> cell_of;
    std::vector<uint32_t> free;
    std::vector<bool> reshaped, changed, only_photos_came, other_observers;
    std::vector<std::vector<uint32_t>> observers;  // photos that observe a point of it, ascending
    std::vector<std::vector<uint32_t>> came;       // photos that see it, in this update

    uint32_t Find(uint32_t cell) const { return cell < of_cell.size() ? of_cell[cell] : kNone; }
    uint32_t Settle(uint32_t cell);
    void Free(uint32_t index);
    void ClearFlags();
    std::vector<Change> TakeChanges();
  };

  void TakeMap(const GuidedMap& map);
  bool Continues(const GuidedMap& map) const;
  void Restart(const GuidedMap& map, const PlaceScale& scale);
  void TakePhotos(const GuidedMap& map);
  std::vector<bool> TakeCameras(const GuidedMap& map);
  bool HasMoved(const GuidedPhoto& before, const GuidedPhoto& now) const;
  void TakePoints(const GuidedMap& map);
  void TakePoint(uint32_t index, const GuidedPoint& now);
  void NoteObservations(const std::vector<uint32_t>& before, const std::vector<uint32_t>& now,
                        bool moves);
  std::optional<Surfel> MakeSurfel(const PointCells& cells, uint32_t cell) const;
  bool IsHeld(const Surfel& before, const Surfel& now, double width) const;
  void MakeWholes();
  void MakeParts();
  void Remake(uint32_t cell, std::optional<Surfel> made, Population* population);
  void TouchPartsIn(uint32_t cell);
  void FindViewers();
  void FindViewersOfParts();
  void SetPhotos(uint32_t index, std::vector<uint32_t> photos, Population* population);
  template <typename Sees>
  std::vector<uint32_t> PhotosOf(const Population& population, uint32_t index,
                                 const std::vector<uint32_t>& sights, const Sees& sees);
  template <typename MayDepend>
  void DoubtEnds(const std::vector<bool>& photos, const MayDepend& may_depend);
  void DoubtEndsSeenBy(const std::vector<bool>& photos);
  void FindUp();
  void FindEnds();
  void JudgeEnds();
  bool SeesAsBefore(uint32_t part, const std::vector<bool>& photos) const;
  bool IsSeenFrom(uint32_t photo, const Surfel& part) const;
  bool AnyMoved(const std::vector<uint32_t>& photos) const;
  bool LooksAt(uint32_t photo, const Surfel& surfel) const;

  const double min_cos_ = std::cos(kMaxSurfelIncidenceDeg * kRadian);
  const double tolerance_;
  const std::optional<PlaceScale> given_scale_;
  Surface& surface_;
  PlaceScale scale_;
  GuidedMap map_;
  std::vector<Eigen::Vector3d> centres_;    // of the photos
  std::vector<uint32_t> num_observations_;  // the same
  size_t num_known_photos_ = 0;             // before this update
  bool any_moved_ = false;
  Population wholes_, parts_;
  std::vector<uint32_t> whole_of_;  // of the parts
  Observers observers_{map_};
  Sights sights_;
  Eigen::Vector3d up_ = Eigen::Vector3d::Zero();
  bool looks_ahead_ = false;
  std::vector<End> ends_;           // of the surfels
  std::vector<bool> ends_to_find_;  // in this update
  std::vector<bool> ends_to_judge_;
  std::vector<uint32_t> reshaped_cells_;  // of wholes
  Changes changes_;
};

}  // namespace skein
