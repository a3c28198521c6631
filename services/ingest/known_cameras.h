// Intrinsics that a person knows: the entries [[cameras]] of a config file.
#pragma once

#include <string>
#include <vector>

#include "config/config_file.h"
#include "core/result.h"
#include "photo/photo_check.h"
#include "sfm/camera.h"

namespace skein {

// Intrinsics of some photos: patterns that select the photos, and parameters. Patterns as for file
// names: * and ?.
struct KnownCamera {
  std::string agent = "*";
  std::string body = "*";  // EXIF's make and model, "MAKE MODEL"
  int width_px = 0;        // of the photos as stored
  int height_px = 0;
  std::string camera_model;    // one of COLMAP's
  std::vector<double> params;  // in COLMAP's order, in pixels of that size
  bool refine = false;         // from `params` on; false: they stay

  // An error names the key to mend.
  Status Check() const;
  bool Fits(const std::string& agent_name, const CheckedPhoto& photo) const;
  double FocalPx() const;  // the mean, if there are two
  // Throws std::invalid_argument for a camera model that does not exist.
  Camera AsCamera() const;
  // As an entry of a config file.
  std::string Text() const;
};

// The sections [[cameras]] of the file, in its order. An error names file, entry and key.
Status ReadKnownCameras(const ConfigFile& file, std::vector<KnownCamera>* cameras);

// The first that fits; null if none does.
const KnownCamera* FindKnownCamera(const std::vector<KnownCamera>& cameras,
                                   const std::string& agent, const CheckedPhoto& photo);

// All entries; with comments also what an entry is.
std::string KnownCamerasText(const std::vector<KnownCamera>& cameras, bool with_comments);

}  // namespace skein
