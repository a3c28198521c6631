#include "export/local_projection.h"

#include <geotiff/geotiffio.h>

namespace skein {

void SetLocalProjection(const GeodeticPosition& origin, GTIF* keys) {
  const auto set = [&](geokey_t key, int value) { GTIFKeySet(keys, key, TYPE_SHORT, 1, value); };
  const auto set_double = [&](geokey_t key, double value) {
    GTIFKeySet(keys, key, TYPE_DOUBLE, 1, value);
  };
  set(GTModelTypeGeoKey, ModelTypeProjected);
  set(GeographicTypeGeoKey, GCS_WGS_84);
  set(GeogAngularUnitsGeoKey, Angular_Degree);
  set(ProjectedCSTypeGeoKey, KvUserDefined);
  set(ProjectionGeoKey, KvUserDefined);
  set(ProjCoordTransGeoKey, CT_TransverseMercator);
  set(ProjLinearUnitsGeoKey, Linear_Meter);
  set_double(ProjNatOriginLatGeoKey, origin.latitude_deg);
  set_double(ProjNatOriginLongGeoKey, origin.longitude_deg);
  set_double(ProjScaleAtNatOriginGeoKey, 1);
  set_double(ProjFalseEastingGeoKey, 0);
  set_double(ProjFalseNorthingGeoKey, 0);
}

}  // namespace skein
