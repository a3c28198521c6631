// Seeded painters of walls, ground and posters. Sizes in metres; an image has `texels_per_m`.
// Pictures have detail at all scales, the plain ones hardly any. Two pictures are alike only with
// the same seed.
#pragma once

#include <opencv2/core.hpp>

#include "clients/places/random.h"

namespace skein::sim {

// Noise of wavelengths from `coarse_px` down to `fine_px`. Each octave has `persistence` times the
// amplitude of the one above. Mean 0, standard deviation 1.
cv::Mat1f Noise(cv::Size size, float coarse_px, float fine_px, float persistence, Random* random);
// image *= 1 + strength * field
void Modulate(const cv::Mat1f& field, float strength, cv::Mat3b* image);

// A painter's sheet: metres in, texels out.
struct Sheet {
  cv::Mat3b image;
  float texels_per_m;

  Sheet(double width_m, double height_m, float density)
      : image(std::max(8, cvRound(height_m * density)), std::max(8, cvRound(width_m * density))),
        texels_per_m(density) {}
  int Px(double metres) const { return cvRound(metres * texels_per_m); }
  cv::Rect Box(double x, double y, double w, double h) const {
    return cv::Rect(Px(x), Px(y), Px(w), Px(h)) & cv::Rect({0, 0}, image.size());
  }
  double width_m() const { return image.cols / texels_per_m; }
  double height_m() const { return image.rows / texels_per_m; }
};

enum class WallKind { kBrick, kPlaster, kStone, kConcrete, kPlanks, kCount };

cv::Scalar RandomColor(Random* random, double low, double high, double saturation);

void PaintWall(WallKind kind, Random* random, Sheet* sheet);
void PaintGround(Random* random, Sheet* sheet);
void PaintFloor(Random* random, Sheet* sheet);  // indoors
void PaintTrim(Random* random, Sheet* sheet);   // sills, cornices, furniture
void PaintPlain(Random* random, Sheet* sheet);  // light grey paint
void PaintCloth(Random* random, Sheet* sheet);  // light grey with folds

// A painted indoor wall: one colour in uneven light, a few scuffs.
void PaintPlainWall(Random* random, Sheet* sheet);
void PaintPlainFloor(Random* random, Sheet* sheet);  // laminate or carpet
void PaintPicture(Random* random, Sheet* sheet);     // soft: a landscape or a portrait
void PaintRug(Random* random, Sheet* sheet);

void PaintWindow(const cv::Rect& box, Random* random, Sheet* sheet);
void PaintDoor(const cv::Rect& box, Random* random, Sheet* sheet);
void PaintPoster(const cv::Rect& box, Random* random, Sheet* sheet);
void PaintGraffiti(const cv::Rect& box, Random* random, Sheet* sheet);
void PaintIvy(const cv::Rect& box, Random* random, Sheet* sheet);
void PaintStreaks(const cv::Rect& box, Random* random, Sheet* sheet);  // dirt that ran down
void PaintSpeckle(double per_m2, double min_m, double max_m, double contrast, Random* random,
                  Sheet* sheet);
void Mute(double share, Sheet* sheet);  // colours towards grey
void PaintCracks(int count, Random* random, Sheet* sheet);

}  // namespace skein::sim
