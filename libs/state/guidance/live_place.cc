#include "guidance/live_place.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "guidance/surfel_views.h"

namespace skein {
namespace {

constexpr uint32_t kNone = PointCells::kNone;

// Pieces share their surfel's area as their cells do.
void ShareAreas(PlaceQuality* place) {
  std::vector<double> sums(place->surfels.size(), 0);
  for (const Piece& piece : place->pieces) {
    if (!piece.IsGone()) sums[piece.whole] += piece.surfel.area;
  }
  for (Piece& piece : place->pieces) {
    if (piece.IsGone()) continue;
    const double area = place->surface.surfels[piece.whole].area;
    piece.area = area * piece.surfel.area / sums[piece.whole];
  }
}

}  // namespace

LivePlace::LivePlace(const Holding& holding)
    : tolerance_(holding.tolerance), surface_(holding, &place_.surface) {}

const PlaceQuality& LivePlace::Update(const GuidedMap& map, double target_gsd) {
  surface_.Update(map);
  if (surface_.changes().all) Clear();
  const bool has_other_target = SetTarget(target_gsd);
  AssessSurfels();
  AssessParts();
  if (has_other_target) AssessAgain();
  JudgeWholes();
  for (Piece& piece : place_.pieces) piece.surfel.is_ground = surface_.IsGround(piece.surfel);
  ShareAreas(&place_);
  const double hole_share = holes_.Update(surface_.map(), surface_.changes().other_observations);
  place_.completeness = Summarise(target_gsd_, max_gsd_, place_, hole_share);
  return place_;
}

void LivePlace::Clear() {
  place_.surfels.clear();
  place_.pieces.clear();
  surfel_textures_.clear();
  part_textures_.clear();
  piece_of_part_.clear();
  piece_of_surfel_.clear();
  free_pieces_.clear();
  holes_ = {};
}

// True: what was assessed with the one before is to be assessed again.
bool LivePlace::SetTarget(double target_gsd) {
  constexpr double kShare = 0.2;  // of the tolerance
  const double usual = 2 * place_.surface.median_gsd;
  const double wanted = target_gsd > 0 ? target_gsd : usual;
  const double wanted_max = std::max(wanted, usual);
  const auto is_near = [&](double value, double held) {
    return std::abs(value - held) <= kShare * tolerance_ * std::max(value, held);
  };
  const bool is_first = surface_.changes().all;
  if (!is_first && is_near(wanted, target_gsd_) && is_near(wanted_max, max_gsd_)) return false;
  target_gsd_ = wanted;
  max_gsd_ = wanted_max;
  return !is_first;
}

void LivePlace::AssessSurfels() {
  const std::vector<Surfel>& surfels = place_.surface.surfels;
  place_.surfels.resize(surfels.size());
  surfel_textures_.resize(surfels.size());
  piece_of_surfel_.resize(surfels.size(), kNone);
  for (const Change& change : surface_.changes().surfels) {
    const uint32_t i = change.index;
    Assess(surfels[i], place_.surface.cell, change, &surfel_textures_[i], &place_.surfels[i]);
    RemovePiece(&piece_of_surfel_[i]);
  }
}

void LivePlace::AssessParts() {
  const std::vector<Surfel>& parts = surface_.parts();
  part_textures_.resize(parts.size());
  piece_of_part_.resize(parts.size(), kNone);
  for (const Change& change : surface_.changes().parts) {
    const uint32_t i = change.index;
    if (parts[i].IsGone()) {
      RemovePiece(&piece_of_part_[i]);
      continue;
    }
    if (piece_of_part_[i] == kNone) piece_of_part_[i] = AddPiece();
    Piece& piece = place_.pieces[piece_of_part_[i]];
    piece.surfel = parts[i];
    piece.width = surface_.part_width();
    piece.whole = surface_.whole_of()[i];
    Assess(parts[i], piece.width, change, &part_textures_[i], &piece.quality);
  }
}

void LivePlace::Assess(const Surfel& surfel, double width, const Change& change,
                       TexturedShare* texture, SurfelQuality* quality) const {
  *quality = {};
  if (!change.came) *texture = {};
  if (surfel.IsGone()) return;
  texture->Add(surface_.map(), surfel, width, change.came ? *change.came : surfel.photos);
  AssessGeometry(surfel, *texture, quality);
}

void LivePlace::AssessGeometry(const Surfel& surfel, const TexturedShare& texture,
                               SurfelQuality* quality) const {
  *quality = AssessSurfel(target_gsd_, surfel.normal, ViewsOf(surface_.map(), surfel));
  quality->textured_share = texture.share();
  quality->counts = quality->best_gsd <= max_gsd_;
  quality->good = quality->good && HasTexture(*quality);
}

// With another target.
void LivePlace::AssessAgain() {
  for (uint32_t i = 0; i < place_.surfels.size(); ++i) {
    const Surfel& surfel = place_.surface.surfels[i];
    if (!surfel.IsGone()) AssessGeometry(surfel, surfel_textures_[i], &place_.surfels[i]);
    RemovePiece(&piece_of_surfel_[i]);
  }
  for (uint32_t i = 0; i < piece_of_part_.size(); ++i) {
    if (piece_of_part_[i] == kNone) continue;
    Piece& piece = place_.pieces[piece_of_part_[i]];
    AssessGeometry(piece.surfel, part_textures_[i], &piece.quality);
  }
}

// A surfel without parts is a piece itself.
void LivePlace::JudgeWholes() {
  std::vector<bool> has_parts(place_.surfels.size(), false);
  for (uint32_t i = 0; i < piece_of_part_.size(); ++i) {
    if (piece_of_part_[i] != kNone) has_parts[surface_.whole_of()[i]] = true;
  }
  for (uint32_t i = 0; i < has_parts.size(); ++i) {
    const Surfel& surfel = place_.surface.surfels[i];
    const bool is_piece = !has_parts[i] && !surfel.IsGone();
    if (is_piece == (piece_of_surfel_[i] != kNone)) continue;
    if (!is_piece) {
      RemovePiece(&piece_of_surfel_[i]);
    } else {
      piece_of_surfel_[i] = AddPiece();
      place_.pieces[piece_of_surfel_[i]] = {surfel, place_.surface.cell, i, 0, place_.surfels[i]};
    }
  }
}

uint32_t LivePlace::AddPiece() {
  if (free_pieces_.empty()) {
    place_.pieces.emplace_back();
    return static_cast<uint32_t>(place_.pieces.size() - 1);
  }
  const uint32_t piece = free_pieces_.back();
  free_pieces_.pop_back();
  return piece;
}

// A gap; `piece` is none then.
void LivePlace::RemovePiece(uint32_t* piece) {
  if (*piece == kNone) return;
  place_.pieces[*piece] = {};
  free_pieces_.push_back(std::exchange(*piece, kNone));
}

}  // namespace skein
