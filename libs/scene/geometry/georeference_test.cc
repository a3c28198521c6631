#include "geometry/georeference.h"

#include <gtest/gtest.h>

#include <cmath>

#include "geometry/georeference_json.h"
#include "testing/test_random.h"

namespace skein::georeference_test {

constexpr double kMetresPerDegree = 111'000;

struct Flight {
  int num_photos = 40;
  double noise_m = 2;
  double outliers = 0;          // share of positions that are hundreds of metres off
  double without = 0;           // share of photos that carry 0, 0
  double without_altitude = 0;  // share of positions that lack it
  double length_m = 100;        // along the first axis
  double width_m = 60;          // along the second
  double height_m = 20;
  double drift_per_m = 0;  // of altitudes, along the first axis
  bool turned = true;      // else north is always up in the photos
  bool tumbling = false;   // photos in all directions
  GeodeticPosition origin{48.1, 11.5, 520};
};

// Photos of a flight: a model in a frame of its own, positions near the origin.
class World {
 public:
  explicit World(const Flight& flight, unsigned seed = 3) : random_(seed), origin(flight.origin) {
    enu_from_model.scale = 7.5;
    enu_from_model.rotation = Eigen::Quaterniond(0.3, -0.5, 0.7, 0.1).normalized();
    enu_from_model.translation = {40, -25, 60};
    const Similarity model_from_enu = enu_from_model.Inverse();
    for (int i = 0; i < flight.num_photos; ++i) {
      const Eigen::Vector3d enu(flight.length_m * Uniform(), flight.width_m * Uniform(),
                                60 + flight.height_m * Uniform());
      GeoPhoto photo;
      photo.name = "drone/" + std::to_string(i) + ".jpg";
      const Eigen::Quaterniond yaw(
          Eigen::AngleAxisd(flight.turned ? 3 * Uniform() : 0.3, Eigen::Vector3d::UnitZ()));
      // Looks down, a few degrees off.
      const Eigen::Quaterniond down =
          Eigen::Quaterniond(0.03 * Normal(), 1, 0.03 * Normal(), 0.03 * Normal()).normalized();
      CameraPose pose{flight.tumbling ? RandomRotation(&random_) : down * yaw, {}};
      pose.translation = -(pose.rotation * enu);
      photo.cam_from_world = TransformPose(model_from_enu, pose);
      photo.position = At(enu + flight.noise_m * Eigen::Vector3d(Normal(), Normal(), Normal()));
      if (i < flight.outliers * flight.num_photos) {
        photo.position = At(enu + 500 * Eigen::Vector3d(Uniform(), 1, Uniform()));
      } else if (i >= (1 - flight.without) * flight.num_photos) {
        photo.position = {};
      }
      if (photo.position.altitude_m) *photo.position.altitude_m += flight.drift_per_m * enu.x();
      if (i % 10 < 10 * flight.without_altitude) photo.position.altitude_m.reset();
      enus.push_back(enu);
      photos.push_back(photo);
    }
  }

  // Largest distance in metres of a photo from its true place.
  double MaxError(const Georeference& result) const {
    double error = 0;
    for (size_t i = 0; i < photos.size(); ++i) {
      error = std::max(
          error, (result.enu_from_model.Apply(photos[i].cam_from_world.Centre()) - enus[i]).norm());
    }
    return error;
  }

 private:
  double Uniform() { return skein::Uniform(-1, 1, &random_); }
  double Normal() { return skein::Normal(1, &random_); }
  // On the tangent plane: good to millimetres within these flights.
  GeodeticPosition At(const Eigen::Vector3d& enu) const {
    GeodeticPosition p = origin;
    for (int i = 0; i < 5; ++i) {
      const Eigen::Vector3d missing = enu - EnuFromGeodetic(origin, p);
      p.latitude_deg += missing.y() / kMetresPerDegree;
      p.longitude_deg +=
          missing.x() / (kMetresPerDegree * std::cos(origin.latitude_deg * M_PI / 180));
      *p.altitude_m += missing.z();
    }
    return p;
  }
  std::mt19937 random_;

 public:
  GeodeticPosition origin;
  Similarity enu_from_model;
  std::vector<Eigen::Vector3d> enus;
  std::vector<GeoPhoto> photos;
};

TEST(Enu, AxesPointEastNorthAndUp) {
  const GeodeticPosition origin{-33.9, 151.2, 30};
  EXPECT_LT(EnuFromGeodetic(origin, origin).norm(), 1e-6);
  const Eigen::Vector3d north = EnuFromGeodetic(origin, {-33.899, 151.2, 30});
  EXPECT_NEAR(north.y(), 110.92, 0.02);  // radius of the meridian there: 6,355,280 m
  EXPECT_NEAR(north.x(), 0, 1e-6);
  const Eigen::Vector3d east = EnuFromGeodetic(origin, {-33.9, 151.201, 30});
  EXPECT_NEAR(east.x(), 92.49, 0.02);
  EXPECT_NEAR(EnuFromGeodetic(origin, {-33.9, 151.2, 42}).z(), 12, 1e-6);
}

TEST(Enu, OriginIsTheMedianAlsoAcrossTheDateLine) {
  const GeodeticPosition origin =
      EnuOrigin({{10, 179.999, 5}, {10, -179.999, 5}, {10.0001, 180, 5}, {0, 0, 0}, {95, 0, 0}});
  EXPECT_NEAR(origin.latitude_deg, 10, 1e-3);
  EXPECT_NEAR(std::abs(origin.longitude_deg), 180, 2e-3);
  EXPECT_EQ(origin.altitude_m, 5);
}

// A median of each axis for itself may lie where nobody was: here the north-east, of a flight along
// the west and the south.
TEST(Enu, OriginIsWhereAPhotoWasTaken) {
  std::vector<GeodeticPosition> photos;
  for (int i = 1; i <= 10; ++i) photos.push_back({48.0 + 0.001 * i, 11.0, 300.0 + i});
  for (int i = 1; i <= 11; ++i) photos.push_back({48.0, 11.0 + 0.001 * i, {}});
  photos.push_back({0, 0, 0});
  photos.push_back({91, 0, -4000});
  const GeodeticPosition origin = EnuOrigin(photos);
  EXPECT_TRUE(std::any_of(photos.begin(), photos.end(), [&](const GeodeticPosition& photo) {
    return photo.latitude_deg == origin.latitude_deg && photo.longitude_deg == origin.longitude_deg;
  }));
  EXPECT_GE(origin.altitude_m.value(), 301) << "those that lack it are not at 0";
  EXPECT_LE(origin.altitude_m.value(), 310);
  EXPECT_FALSE(EnuOrigin({{48, 11, {}}, {48.1, 11, {}}}).altitude_m);
  EXPECT_FALSE(EnuOrigin({}).altitude_m);
}

TEST(Georeference, IsExactWithoutNoise) {
  Flight flight;
  flight.noise_m = 0;
  const World world(flight);
  const Georeference result = EstimateGeoreference(world.origin, world.photos);
  ASSERT_TRUE(result.ok) << result.reason;
  EXPECT_LT(world.MaxError(result), 0.01);
  EXPECT_NEAR(result.enu_from_model.scale, 7.5, 1e-3);
  EXPECT_EQ(result.num_inliers, 40);
}

TEST(Georeference, WithstandsWrongAndMissingPositions) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    Flight flight;
    flight.outliers = 0.3;
    flight.without = 0.2;
    const World world(flight, seed);
    const Georeference result = EstimateGeoreference(world.origin, world.photos);
    ASSERT_TRUE(result.ok) << result.reason << " seed " << seed;
    // 20 good positions of 2 m per axis.
    EXPECT_LT(world.MaxError(result), 5) << "seed " << seed;
    EXPECT_NEAR(result.sigma_m, 2, 1) << "seed " << seed;
    ASSERT_EQ(result.residuals.size(), 32u);
    for (size_t i = 0; i < 12; ++i) EXPECT_FALSE(result.residuals[i].inlier) << i;
    EXPECT_GE(result.num_inliers, 17) << "seed " << seed;
  }
}

TEST(Georeference, LeavesOutAltitudesThatDrift) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    for (const bool turned : {false, true}) {
      Flight flight;
      flight.drift_per_m = 1;
      flight.turned = turned;
      flight.outliers = 0.1;
      World world(flight, seed);
      const Georeference result = EstimateGeoreference(world.origin, world.photos);
      ASSERT_TRUE(result.ok) << result.reason << " seed " << seed;
      EXPECT_FALSE(result.altitudes_used) << seed;
      EXPECT_NEAR(result.sigma_m, 2, 1) << seed;
      const Eigen::Vector3d up =
          result.enu_from_model.rotation *
          (world.enu_from_model.rotation.conjugate() * Eigen::Vector3d::UnitZ());
      EXPECT_GT(up.z(), std::cos(5 * M_PI / 180)) << seed;
    }
  }
}

TEST(Georeference, TakesNoAltitudeForZero) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    for (const double without_altitude : {0.3, 0.5, 0.8}) {
      Flight flight;
      flight.without_altitude = without_altitude;
      flight.outliers = 0.1;
      World world(flight, seed);
      std::vector<GeodeticPosition> positions;
      for (const GeoPhoto& photo : world.photos) positions.push_back(photo.position);
      const GeodeticPosition origin = EnuOrigin(positions);
      EXPECT_NEAR(origin.altitude_m.value(), 580, 80) << seed;
      const Georeference result = EstimateGeoreference(world.origin, world.photos);
      ASSERT_TRUE(result.ok) << result.reason << " seed " << seed;
      EXPECT_LT(world.MaxError(result), 12) << seed << " without " << without_altitude;
      EXPECT_NEAR(result.sigma_m, 2, 1) << seed;
    }
  }
}

TEST(Georeference, DoesWithoutAnyAltitude) {
  Flight flight;
  flight.without_altitude = 1;
  World world(flight);
  GeodeticPosition origin = world.origin;
  origin.altitude_m.reset();
  const Georeference result = EstimateGeoreference(origin, world.photos);
  ASSERT_TRUE(result.ok) << result.reason;
  EXPECT_FALSE(result.altitudes_used);
  std::vector<double> heights;
  for (size_t i = 0; i < world.photos.size(); ++i) {
    const Eigen::Vector3d enu =
        result.enu_from_model.Apply(world.photos[i].cam_from_world.Centre());
    EXPECT_LT((enu - world.enus[i]).head<2>().norm(), 5);
    heights.push_back(enu.z());
  }
  std::sort(heights.begin(), heights.end());
  EXPECT_NEAR(heights[heights.size() / 2], 0, 0.5) << "above the median camera";
  const nlohmann::json json = GeoreferenceToJson(Summarise(result));
  EXPECT_EQ(json["altitudes"], 0);
  EXPECT_TRUE(json["origin"]["altitude_m"].is_null());
  EXPECT_TRUE(json["residual_m"]["vertical_rmse"].is_null());
}

TEST(Georeference, RefusesALineWithoutAltitudes) {
  Flight flight;
  flight.without_altitude = 1;
  flight.length_m = flight.width_m = flight.height_m = 0.2;
  World world(flight);
  const Georeference result = EstimateGeoreference(world.origin, world.photos);
  EXPECT_FALSE(result.ok);
  EXPECT_NE(result.reason.find("spot"), std::string::npos) << result.reason;
}

TEST(Georeference, UsesAltitudesWhateverTheCamerasLookAt) {
  Flight flight;
  flight.tumbling = true;
  const World world(flight);
  const Georeference result = EstimateGeoreference(world.origin, world.photos);
  ASSERT_TRUE(result.ok) << result.reason;
  EXPECT_TRUE(result.altitudes_used);
  EXPECT_LT(world.MaxError(result), 5);
}

TEST(Georeference, ToldPrecisionHolds) {
  double sum = 0;
  int count = 0;
  for (unsigned seed = 1; seed <= 50; ++seed) {
    const World world({}, seed);
    const Georeference result = EstimateGeoreference(world.origin, world.photos);
    ASSERT_TRUE(result.ok) << result.reason;
    const double off = (result.enu_from_model.scale / 7.5 - 1) / result.scale_sigma;
    sum += off * off;
    ++count;
  }
  EXPECT_NEAR(std::sqrt(sum / count), 1, 0.35);
}

TEST(Georeference, RefusesTooFewPositions) {
  Flight flight;
  flight.num_photos = 4;
  World world(flight);
  Georeference result = EstimateGeoreference(world.origin, world.photos);
  EXPECT_FALSE(result.ok);
  EXPECT_EQ(result.reason, "4 registered photos carry a position; it takes 5");
  flight.num_photos = 40;
  flight.without = 1;
  world = World(flight);
  result = EstimateGeoreference(world.origin, world.photos);
  EXPECT_EQ(result.reason, "0 registered photos carry a position; it takes 5");
  EXPECT_FALSE(GeoreferenceToJson(Summarise(result))["ok"]);
}

TEST(Georeference, RefusesPositionsThatDoNotAgree) {
  Flight flight;
  flight.outliers = 0.7;
  flight.noise_m = 0.1;
  const World world(flight);
  const Georeference result = EstimateGeoreference(world.origin, world.photos);
  EXPECT_FALSE(result.ok) << result.num_inliers << " sigma " << result.sigma_m;
  EXPECT_FALSE(result.reason.empty());
}

TEST(Georeference, RefusesALine) {
  for (const double noise_m : {0.0, 2.0}) {
    for (const double width_m : {0.0, 0.3}) {
      Flight flight;
      flight.noise_m = noise_m;
      flight.width_m = flight.height_m = width_m;
      if (noise_m == 0 && width_m > 0) continue;  // exact positions determine that one
      const World world(flight);
      const Georeference result = EstimateGeoreference(world.origin, world.photos);
      EXPECT_FALSE(result.ok) << noise_m << " " << width_m;
      EXPECT_NE(result.reason.find("line"), std::string::npos) << result.reason;
    }
  }
}

TEST(Georeference, RefusesOneSpot) {
  for (const double noise_m : {0.0, 2.0}) {
    Flight flight;
    flight.noise_m = noise_m;
    flight.length_m = flight.width_m = flight.height_m = std::max(0.001, noise_m / 10);
    const World world(flight);
    const Georeference result = EstimateGeoreference(world.origin, world.photos);
    EXPECT_FALSE(result.ok) << noise_m;
    EXPECT_NE(result.reason.find("spot"), std::string::npos) << result.reason;
    EXPECT_NE(result.reason.find("; walk around"), std::string::npos) << result.reason;
  }
}

TEST(Georeference, RefusesADeviceThatReportsOnePlaceForAll) {
  World world({});
  for (GeoPhoto& photo : world.photos) photo.position = world.photos[0].position;
  Georeference result = EstimateGeoreference(world.origin, world.photos);
  EXPECT_FALSE(result.ok);
  EXPECT_EQ(result.reason.rfind("all 40 photos carry one GPS position, ", 0), 0u) << result.reason;
  world.photos[1].position.latitude_deg += 0.001;
  result = EstimateGeoreference(world.origin, world.photos);
  EXPECT_EQ(result.reason.rfind("40 photos carry only 2 different", 0), 0u) << result.reason;
}

// Alice's photos and bob's in turns, over the same place.
World OfAliceAndBob(void (*spoil)(GeodeticPosition* position_of_bob)) {
  Flight flight;
  flight.noise_m = 0.5;
  World world(flight);
  for (size_t i = 0; i < world.photos.size(); ++i) {
    world.photos[i].name = (i % 2 ? "bob/" : "alice/") + std::to_string(i) + ".jpg";
    if (i % 2) spoil(&world.photos[i].position);
  }
  return world;
}

TEST(Georeference, NamesTheAgentWhoseLatitudeAndLongitudeAreSwapped) {
  const World world =
      OfAliceAndBob([](GeodeticPosition* p) { std::swap(p->latitude_deg, p->longitude_deg); });
  const Georeference result = EstimateGeoreference(world.origin, world.photos);
  EXPECT_FALSE(result.ok);
  EXPECT_EQ(result.reason.rfind("the GPS positions of bob are ", 0), 0u) << result.reason;
  EXPECT_NE(result.reason.find("those of alice"), std::string::npos) << result.reason;
  EXPECT_NE(result.reason.find("order of coordinates"), std::string::npos) << result.reason;
}

// Both fit among themselves: bob or alice is off.
TEST(Georeference, NamesTwoAgentsThatAreApartAndTheMedianOffset) {
  const World world =
      OfAliceAndBob([](GeodeticPosition* p) { p->latitude_deg += 2000 / kMetresPerDegree; });
  const Georeference result = EstimateGeoreference(world.origin, world.photos);
  EXPECT_FALSE(result.ok);
  for (const char* part : {"bob", "alice", " are 2 km (median) off "}) {
    EXPECT_NE(result.reason.find(part), std::string::npos) << result.reason;
  }
}

TEST(Georeference, TellsPositionsOfOneAgentThatDisagreeWithTheMap) {
  Flight flight;
  flight.noise_m = 1000;
  const World world(flight);
  const Georeference result = EstimateGeoreference(world.origin, world.photos);
  EXPECT_FALSE(result.ok);
  EXPECT_NE(result.reason.find("disagree with the map"), std::string::npos) << result.reason;
}

TEST(Georeference, JsonHoldsTransformAndResiduals) {
  Flight flight;
  flight.outliers = 0.1;
  const World world(flight);
  const Georeference result = EstimateGeoreference(world.origin, world.photos);
  const nlohmann::json json = GeoreferenceToJson(Summarise(result));
  EXPECT_TRUE(json["ok"]);
  EXPECT_EQ(json["positions"], 40);
  EXPECT_EQ(json["outliers"].size() + json["inliers"].get<size_t>(), 40u);
  EXPECT_NEAR(json["residual_m"]["rmse"], 2 * std::sqrt(3), 1);
  EXPECT_EQ(json["origin"]["latitude_deg"], 48.1);
  EXPECT_EQ(json["enu_from_model"]["scale"], result.enu_from_model.scale);
}

TEST(Georeference, TheOriginComesBackFromJson) {
  Georeference georeference;
  georeference.ok = true;
  for (const std::optional<double> altitude : {std::optional<double>(), {400.0}}) {
    georeference.origin = {48.1, 11.5, altitude};
    const GeodeticPosition origin = OriginOf(GeoreferenceToJson(Summarise(georeference)));
    EXPECT_EQ(origin.latitude_deg, 48.1);
    EXPECT_EQ(origin.longitude_deg, 11.5);
    EXPECT_EQ(origin.altitude_m, altitude);
  }
}

}  // namespace skein::georeference_test
