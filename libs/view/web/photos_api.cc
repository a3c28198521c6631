#include "web/photos_api.h"

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "blobs/blob_store.h"
#include "core/file_below.h"
#include "formats/formats.h"
#include "ledger/session_folder.h"
#include "web/events.h"

namespace skein {
namespace {

using nlohmann::json;

// Photo 1 of another session may have had the same URL. The query's `v` is the commit time of the
// photo, so only a URL of this very photo may be cached.
bool IsOfThisPhotoAlone(const HttpRequest& request, const image_t& image) {
  const auto version = request.query.find("v");
  return version != request.query.end() && version->second == std::to_string(image.header.utime_us);
}

// Agents choose the names of photos, so a name like page.html must not give the type text/html.
std::string TypeOfPhoto(const std::string& name) {
  const std::string type = ContentTypeOf(name);
  const bool is_taken = type == "image/jpeg" || type == "image/png" || type == "image/tiff";
  return is_taken ? type : "application/octet-stream";
}

json PointJson(const Keypoint& keypoint) {
  return {Rounded(keypoint.x, kPixelDigits), Rounded(keypoint.y, kPixelDigits)};
}

}  // namespace

PhotosApi::PhotosApi(const SessionView& view, const SessionSource& source, BlobFetcher& blobs,
                     JobPool& pool)
    : view_(view), source_(source), blobs_(blobs), pool_(pool) {}

void PhotosApi::Handle(const PathParts& parts, const HttpRequest& request, Respond respond) {
  const std::optional<int64_t> id = ParseId(parts[1]);
  if (!id) return respond(HttpError(400, "a photo is a number"));
  if (parts.size() == 2) return GetPhoto(*id, request, respond);
  if (parts.size() == 3 && parts[2] == "thumbnail") return GetThumbnail(*id, request, respond);
  if (parts.size() == 3 && parts[2] == "matches") return GetMatches(*id, respond);
  const std::optional<int64_t> other =
      parts.size() == 4 && parts[2] == "matches" ? ParseId(parts[3]) : std::nullopt;
  if (other) return GetMatch(*id, *other, respond);
  respond(HttpError(404, "there is no such path; /api/photos/ID/thumbnail is one"));
}

image_t PhotosApi::ImageOf(int64_t image_id) const {
  return view_.With([&](const SessionRecord& session) {
    const PhotoState* photo = session.state.FindPhoto(image_id);
    return photo == nullptr ? image_t() : photo->image;
  });
}

void PhotosApi::GetPhoto(int64_t image_id, const HttpRequest& request, Respond respond) {
  const image_t image = ImageOf(image_id);
  if (image.blob_id.empty()) return respond(NoSuch("photo " + std::to_string(image_id)));
  HttpResponse response;
  response.content_type = TypeOfPhoto(image.name);
  response.immutable = IsOfThisPhotoAlone(request, image);
  pool_.Run([this, blob_id = image.blob_id, response, respond = std::move(respond)]() mutable {
    if (!source_.session_dir.empty()) {
      response.file_root = source_.session_dir;
      response.file = BlobStore(SessionPaths{source_.session_dir}.Blobs()).Path(blob_id);
      if (IsFileBelow(response.file_root, response.file)) return respond(std::move(response));
      response.file.clear();
    }
    blobs_.Fetch(blob_id, "ingest", [response, respond](Result<Bytes> bytes) mutable {
      if (!bytes.ok()) return AnswerError(respond, bytes.status());
      response.bytes = std::make_shared<const Bytes>(std::move(*bytes));
      respond(std::move(response));
    });
  });
}

void PhotosApi::GetThumbnail(int64_t image_id, const HttpRequest& request, Respond respond) {
  const image_t image = ImageOf(image_id);
  if (image.blob_id.empty()) return respond(NoSuch("photo " + std::to_string(image_id)));
  const bool immutable = IsOfThisPhotoAlone(request, image);
  const auto answer = [respond, immutable](std::shared_ptr<const Bytes> jpeg) {
    HttpResponse response = BytesResponse(std::move(jpeg), "image/jpeg");
    response.immutable = immutable;
    respond(std::move(response));
  };
  if (const auto known = thumbnails_.Find(image_id)) return answer(known);
  blobs_.FetchAll({image.blob_id}, "ingest", respond,
                  [this, image_id, image, respond, answer](const BlobFetcher::Blobs& blobs) {
                    decoding_.Run([=, photo = blobs.begin()->second] {
                      Result<Bytes> jpeg =
                          thumbnail_maker_.Make(photo, image.orientation, kThumbnailSidePx);
                      if (!jpeg.ok()) return AnswerError(respond, jpeg.status());
                      const auto shared = std::make_shared<const Bytes>(std::move(*jpeg));
                      thumbnails_.Add(image_id, shared);
                      answer(shared);
                    });
                  });
}

void PhotosApi::GetMatches(int64_t image_id, Respond respond) const {
  std::vector<std::pair<int32_t, int64_t>> matches;
  const bool known = view_.With([&](const SessionRecord& session) {
    for (const auto& edge : session.state.covisibility().EdgesOf(image_id)) {
      matches.push_back({edge.num_inliers, edge.other_id});
    }
    return session.state.FindPhoto(image_id) != nullptr;
  });
  if (!known) return respond(NoSuch("photo " + std::to_string(image_id)));
  std::sort(matches.rbegin(), matches.rend());
  json list = json::array();
  for (const auto& [inliers, other] : matches) {
    list.push_back({{"image", other}, {"inliers", inliers}});
  }
  respond(JsonResponse(list.dump()));
}

// Only one of the two photos has the pair in its matches_t.
void PhotosApi::GetMatch(int64_t image_id, int64_t other_id, Respond respond) {
  struct Found {
    std::vector<std::string> pair_blobs;
    std::string keypoints, other_keypoints;
    bool matched = false;
  };
  const Found found = view_.With([&](const SessionRecord& session) {
    Found blobs;
    const PhotoState* photo = session.state.FindPhoto(image_id);
    const PhotoState* other = session.state.FindPhoto(other_id);
    if (photo == nullptr || other == nullptr) return blobs;
    for (const auto& edge : session.state.covisibility().EdgesOf(image_id)) {
      blobs.matched |= edge.other_id == other_id;
    }
    for (const PhotoState* side : {photo, other}) {
      if (!side->pairs_blob.empty()) blobs.pair_blobs.push_back(side->pairs_blob);
    }
    blobs.keypoints = photo->features.keypoints_blob;
    blobs.other_keypoints = other->features.keypoints_blob;
    return blobs;
  });
  if (!found.matched) {
    return respond(NoSuch("verified pair of photos " + std::to_string(image_id) + " and " +
                          std::to_string(other_id)));
  }
  std::vector<std::string> wanted = found.pair_blobs;
  wanted.push_back(found.keypoints);
  wanted.push_back(found.other_keypoints);
  blobs_.FetchAll(wanted, "ingest", respond, [=](const BlobFetcher::Blobs& blobs) {
    const Result<Keypoints> mine = DecodeKeypoints(blobs.at(found.keypoints));
    const Result<Keypoints> others = DecodeKeypoints(blobs.at(found.other_keypoints));
    if (!mine.ok()) return AnswerError(respond, mine.status());
    if (!others.ok()) return AnswerError(respond, others.status());
    json points = json::array();
    // A keypoint has one match: more are no pair's, and take a hundred times their blob's bytes.
    const size_t most = mine->size() + others->size();
    for (const std::string& blob : found.pair_blobs) {
      const Result<TwoViewPairs> pairs = DecodeTwoViewPairs(blobs.at(blob));
      if (!pairs.ok()) return AnswerError(respond, pairs.status());
      for (const TwoViewPair& pair : *pairs) {
        const bool of_mine = pair.other_id == other_id;
        if (!of_mine && pair.other_id != image_id) continue;
        for (const auto& [index, other_index] : pair.inliers) {
          const uint32_t a = of_mine ? index : other_index, b = of_mine ? other_index : index;
          if (a >= mine->size() || b >= others->size()) continue;
          if (points.size() == most) {
            return AnswerError(respond, DataLoss("more matches than keypoints"));
          }
          json point = PointJson((*mine)[a]);
          for (const json& value : PointJson((*others)[b])) point.push_back(value);
          points.push_back(std::move(point));
        }
      }
      if (!points.empty()) break;  // told by both
    }
    respond(JsonResponse(json({{"points", std::move(points)}}).dump()));
  });
}

}  // namespace skein
