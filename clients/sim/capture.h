// Plan of the photos that a session takes: each one's camera, pose, exposure, objects in front, and
// EXIF.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "clients/places/effects.h"
#include "clients/places/render.h"
#include "clients/sim/scenario.h"
#include "codecs/photo_encoding.h"

namespace skein::sim {

struct SimOptions {
  ScenarioOptions scenario;
  std::string out;
  int width = 1280, height = 960;
  double focal_px = 0;  // 0: 0.86 of the width
  double distortion = -0.05;
  bool gps = false;
  int threads = 1;
};

struct Capture {
  std::string agent, file;
  int camera = 0;  // index into CapturePlan::cameras
  Shot shot;
  Shutter shutter;
  Exposure exposure;
  std::vector<Surface> moving;  // in this photo alone
  std::optional<ExifInfo> exif;
  int quality = kJpegQuality;
};

struct CapturePlan {
  std::vector<Camera> cameras;
  std::vector<Capture> captures;  // in the order in which they are taken
};

// A function of the options. `place`: BuildPlace's, for the automatic exposure of videos.
CapturePlan PlanCaptures(const SimOptions& options, const Place& place);

// The next photo of an agent that stands where nobody planned it: number `index` from 0, with the
// agent's own camera (index `agent` into `cameras`, as PlanCaptures makes them; not for kCrowd).
Capture CaptureAt(const SimOptions& options, const std::vector<Camera>& cameras, int agent,
                  const std::string& name, int index, const Pose& pose);

// The photo as its camera stores it, before compression.
cv::Mat3b RenderCapture(const Place& place, const Camera& camera, const Capture& capture);

}  // namespace skein::sim
