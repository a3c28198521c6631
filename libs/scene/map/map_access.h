#pragma once

#include "map/scene_map.h"

namespace skein {

// Structures inside of a map, to change. For libs/scene/map alone; others say what they do by
// SceneMap's functions (tests/static/layering_test.sh).
struct MapAccess {
  static Reconstruction& Model(SceneMap* map) { return *map->reconstruction_; }
  static class Triangulator& Triangulator(SceneMap* map) { return *map->triangulator_; }
};

}  // namespace skein
