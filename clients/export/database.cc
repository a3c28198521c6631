#include "clients/export/database.h"

#include <sqlite3.h>

#include <memory>
#include <optional>
#include <sstream>
#include <vector>

#include "blobs/blob_store.h"
#include "clients/progress_bar.h"
#include "formats/formats.h"
#include "ledger/ledger_record.h"
#include "sfm/camera.h"
#include "sfm/database.h"
#include "sfm/two_view_geometry.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

Eigen::Matrix3d ToMatrix(const std::array<double, 9>& row_major) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(row_major.data());
}

class DatabaseWriter {
 public:
  DatabaseWriter(const BlobStore& blobs, const fs::path& file)
      : blobs_(blobs), database_(file.string()) {}

  Status Write(const Fact& fact) {
    if (const auto* image = std::get_if<skein::image_t>(&fact)) return WriteImage(*image);
    if (const auto* features = std::get_if<features_t>(&fact)) return WriteFeatures(*features);
    if (const auto* matches = std::get_if<matches_t>(&fact)) return WriteMatches(*matches);
    if (const auto* candidates = std::get_if<candidates_t>(&fact))
      candidates_.push_back(*candidates);
    return Status::Ok();
  }
  const DatabaseCounts& counts() const { return counts_; }
  const std::vector<candidates_t>& candidates() const { return candidates_; }

 private:
  Status WriteImage(const skein::image_t& fact) {
    const auto camera_id = static_cast<CameraId>(fact.camera_id);
    if (!database_.ExistsCamera(camera_id)) {
      Camera camera;
      camera.SetCameraId(camera_id);
      camera.InitializeWithName("SIMPLE_RADIAL", fact.focal_px, fact.width_px, fact.height_px);
      camera.SetPriorFocalLength(fact.focal_from_exif != 0);
      database_.WriteCamera(camera);
    }
    database_.WriteImage(static_cast<ImageId>(fact.image_id), camera_id,
                         fact.agent + "/" + fact.name);
    ++counts_.images;
    return Status::Ok();
  }

  Status WriteFeatures(const features_t& fact) {
    const auto image_id = static_cast<ImageId>(fact.image_id);
    const Result<Bytes> keypoint_bytes = blobs_.Get(fact.keypoints_blob);
    if (!keypoint_bytes) return keypoint_bytes.status();
    const Result<Keypoints> keypoints = DecodeKeypoints(*keypoint_bytes);
    if (!keypoints) return keypoints.status();
    const Result<Bytes> descriptor_bytes = blobs_.Get(fact.descriptors_blob);
    if (!descriptor_bytes) return descriptor_bytes.status();
    const Result<Descriptors> descriptors = DecodeDescriptors(*descriptor_bytes);
    if (!descriptors) return descriptors.status();
    database_.WriteKeypoints(image_id, *keypoints);
    database_.WriteDescriptors(image_id, *descriptors);
    return Status::Ok();
  }

  Status WriteMatches(const matches_t& fact) {
    if (fact.pairs_blob.empty()) return Status::Ok();
    const Result<Bytes> bytes = blobs_.Get(fact.pairs_blob);
    if (!bytes) return bytes.status();
    const Result<TwoViewPairs> pairs = DecodeTwoViewPairs(*bytes);
    if (!pairs) return pairs.status();
    for (const TwoViewPair& pair : *pairs) {
      WritePair(static_cast<ImageId>(fact.image_id), pair);
    }
    return Status::Ok();
  }

  void WritePair(ImageId image_id, const TwoViewPair& pair) {
    const auto other_id = static_cast<ImageId>(pair.other_id);
    if (database_.ExistsMatches(image_id, other_id)) return;
    TwoViewGeometry geometry;
    geometry.config = pair.geometry;
    geometry.E = ToMatrix(pair.E);
    geometry.F = ToMatrix(pair.F);
    geometry.H = ToMatrix(pair.H);
    geometry.qvec = Eigen::Vector4d(pair.qvec[0], pair.qvec[1], pair.qvec[2], pair.qvec[3]);
    geometry.tvec = Eigen::Vector3d(pair.tvec[0], pair.tvec[1], pair.tvec[2]);
    geometry.tri_angle = pair.tri_angle_rad;
    for (const auto& [mine, others] : pair.inliers) {
      geometry.inlier_matches.emplace_back(mine, others);
    }
    database_.WriteMatches(image_id, other_id, geometry.inlier_matches);
    database_.WriteTwoViewGeometry(image_id, other_id, geometry);
    ++counts_.pairs;
  }

  const BlobStore& blobs_;
  ColmapDatabase database_;
  DatabaseCounts counts_;
  std::vector<candidates_t> candidates_;
};

std::string CandidatesSql(const std::vector<candidates_t>& all) {
  std::ostringstream sql;
  sql << "BEGIN; CREATE TABLE skein_candidates(image_id INTEGER, other_id INTEGER, distance REAL);"
         "CREATE TABLE skein_retrieval(image_id INTEGER, insert_s REAL, query_s REAL);";
  for (const candidates_t& candidates : all) {
    sql << "INSERT INTO skein_retrieval VALUES(" << candidates.image_id << ", "
        << candidates.insert_s << ", " << candidates.query_s << ");";
    for (int i = 0; i < candidates.num_candidates; ++i) {
      sql << "INSERT INTO skein_candidates VALUES(" << candidates.image_id << ", "
          << candidates.other_ids[i] << ", " << candidates.distances[i] << ");";
    }
  }
  sql << "COMMIT;";
  return sql.str();
}

// Beside COLMAP's tables, which know no global descriptors; COLMAP ignores them.
Status WriteCandidates(const fs::path& file, const std::vector<candidates_t>& candidates) {
  sqlite3* raw = nullptr;
  const int opened = sqlite3_open(file.c_str(), &raw);
  const std::unique_ptr<sqlite3, int (*)(sqlite3*)> database(raw, sqlite3_close);
  if (opened != SQLITE_OK) return Unavailable("cannot open " + file.string());
  if (sqlite3_exec(raw, CandidatesSql(candidates).c_str(), nullptr, nullptr, nullptr) !=
      SQLITE_OK) {
    return Unavailable(file.string() + ": " + sqlite3_errmsg(raw));
  }
  return Status::Ok();
}

// Facts whose photo was counted but whose blobs are damaged stop the export: no half database.
Status WriteFacts(const Ledger& ledger, DatabaseWriter* writer) {
  ProgressBar progress("database", ledger.head());
  Status failure;
  const Status read = ledger.ForEach([&](const LedgerRecord& record) {
    progress.Add();
    if (!failure.ok()) return;
    const Result<Fact> fact = DecodeRecord(record);
    failure = (fact ? writer->Write(*fact) : fact.status()).Within(record.fact_id);
  });
  return read.ok() ? failure : read;
}

}  // namespace

Result<DatabaseCounts> WriteDatabase(const SessionPaths& paths, const fs::path& file) {
  if (fs::exists(file)) return AlreadyExists(file.string() + " is there already");
  const Result<std::unique_ptr<Ledger>> ledger = Ledger::OpenReadOnly(paths.Ledger());
  if (!ledger) return ledger.status();
  const BlobStore blobs(paths.Blobs());
  std::optional<DatabaseWriter> writer(std::in_place, blobs, file);
  Status written = WriteFacts(**ledger, &*writer);
  const DatabaseCounts counts = writer->counts();
  const std::vector<candidates_t> candidates = writer->candidates();
  writer.reset();
  if (written.ok()) written = WriteCandidates(file, candidates);
  if (!written.ok()) {
    fs::remove(file);
    return written;
  }
  return counts;
}

}  // namespace skein
