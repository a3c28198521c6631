#pragma once

#include <map>
#include <string>
#include <vector>

#include "map/bundle_builder.h"
#include "map/scene_map.h"
#include "mapping/association_tree.h"

namespace skein {

enum class LocalBaForm { kPaper, kConsistent, kEqual, kColmap };

// The forms by name; docs/methods/local_ba.md tells of them, and why kColmap is the default.
const std::map<std::string, LocalBaForm>& LocalBaForms();
std::string NameOf(LocalBaForm form);

struct LocalWindowOptions {
  LocalBaForm form = LocalBaForm::kColmap;
  // Of kColmap: the new image, those with most points in common with it, of which two are held.
  // COLMAP takes six.
  int colmap_images = 30;
  // Of the forms over the association tree.
  AssociationTreeOptions tree;
  int max_free = 40;      // images, the new one included; 0: no limit (the paper's form)
  int max_held = 80;      // 0: no limit
  int max_points = 8000;  // 0: no limit
};

// The part of the map that a new photo's local BA refines. kColmap: as COLMAP's, with
// `colmap_images`. The others: the association tree's ripples before the last are free with their
// weights, the last one and what exceeds the limits is held, and so are the images that see the
// window's points with the most of them. Over the limit of points half are the new photo's, and
// each other free image has its share of the rest; those that most free images see first.
BundleRequest SelectLocalWindow(const LocalWindowOptions& options, const SceneMap& map,
                                const SimilarityLists& similar, ImageId new_image_id);

}  // namespace skein
