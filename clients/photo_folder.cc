#include "clients/photo_folder.h"

#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "clients/companions.h"
#include "clients/folder_walk.h"
#include "codecs/decode_check.h"
#include "codecs/exif_reader.h"
#include "codecs/image_decoding.h"
#include "codecs/photo_encoding.h"
#include "core/file.h"
#include "core/utf8.h"
#include "photo/heif.h"
#include "photo/image_view.h"
#include "photo/photo_header.h"
#include "photo/photo_name.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

constexpr std::array<const char*, 5> kExtensions = {".jpg", ".jpeg", ".png", ".tif", ".tiff"};
constexpr size_t kMaxKindsTold = 6;
constexpr uint64_t kMaxPixels = 1'000'000'000;  // that are decoded here

std::string LowerExtension(const fs::path& path) { return LowerCase(path.extension().string()); }

bool IsPhotoName(const fs::path& path) {
  const std::string extension = LowerExtension(path);
  return std::find(kExtensions.begin(), kExtensions.end(), extension) != kExtensions.end();
}

bool IsHeif(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  Bytes head(kHeifHeadBytes);
  file.read(reinterpret_cast<char*>(head.data()), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<size_t>(file.gcount()));
  return HeifName(head) != nullptr;
}

int64_t CaptureTime(const fs::path& path) {
  const Result<Bytes> bytes = ReadFile(path.string());
  if (bytes.ok()) {
    const Result<PhotoHeader> header = ReadPhotoHeader(*bytes);
    const int64_t time = header.ok() ? ReadExif(*bytes, *header).capture_utime_us : 0;
    if (time != 0) return time;
  }
  // Not std::filesystem's time, whose epoch is not EXIF's.
  struct stat file {};
  if (::stat(path.c_str(), &file) != 0) return 0;
  return int64_t{file.st_mtim.tv_sec} * 1'000'000 + file.st_mtim.tv_nsec / 1000;
}

void SortByTime(std::vector<PhotoFile>* photos) {
  std::map<fs::path, int64_t> times;
  for (const PhotoFile& photo : *photos) times[photo.path] = CaptureTime(photo.path);
  std::stable_sort(photos->begin(), photos->end(), [&](const PhotoFile& a, const PhotoFile& b) {
    return times[a.path] < times[b.path];
  });
}

// Written out, because std::shuffle differs between standard libraries.
void Shuffle(std::vector<PhotoFile>* photos, uint64_t seed) {
  std::mt19937_64 random(seed);
  for (size_t i = photos->size(); i > 1; --i) std::swap((*photos)[i - 1], (*photos)[random() % i]);
}

constexpr uint8_t kExif[] = {'E', 'x', 'i', 'f', 0, 0};
constexpr char kXmp[] = "http://ns.adobe.com/xap/1.0/";  // and its terminating zero

template <class Id>
bool StartsWith(const uint8_t* content, size_t size, const Id& id) {
  return size >= sizeof(id) && std::memcmp(content, id, sizeof(id)) == 0;
}

// The EXIF and XMP segments with their markers and lengths; empty if there are none.
Bytes MetadataOfJpeg(const Bytes& jpeg) {
  Bytes segments;
  for (size_t at = 2; at + 10 <= jpeg.size() && jpeg[at] == 0xff && jpeg[at + 1] != 0xda;) {
    const size_t length = 2 + (size_t{jpeg[at + 2]} << 8 | jpeg[at + 3]);
    if (length < 4 || length > jpeg.size() - at) break;
    const uint8_t* segment = jpeg.data() + at;
    const bool is_metadata =
        StartsWith(segment + 4, length - 4, kExif) || StartsWith(segment + 4, length - 4, kXmp);
    if (segment[1] == 0xe1 && is_metadata)
      segments.insert(segments.end(), segment, segment + length);
    at += length;
  }
  return segments;
}

// A JPEG's EXIF segment from a PNG's EXIF block. Empty without a block, or when it is too long.
Bytes ExifOfPng(const Bytes& png) {
  constexpr size_t kMaxBlock = 65535 - 2 - sizeof(kExif);
  for (size_t at = 8; at + 12 <= png.size();) {
    const size_t length =
        size_t{png[at]} << 24 | size_t{png[at + 1]} << 16 | size_t{png[at + 2]} << 8 | png[at + 3];
    if (length > png.size() - at - 12) break;
    const auto type = png.begin() + static_cast<ptrdiff_t>(at) + 4;
    if (std::equal(type, type + 4, "eXIf") && length <= kMaxBlock) {
      const size_t size = 2 + sizeof(kExif) + length;
      Bytes segment = {0xff, 0xe1, static_cast<uint8_t>(size >> 8), static_cast<uint8_t>(size)};
      segment.insert(segment.end(), kExif, kExif + sizeof(kExif));
      segment.insert(segment.end(), type + 4, type + 4 + static_cast<ptrdiff_t>(length));
      return segment;
    }
    at += 12 + length;
  }
  return {};
}

Bytes MetadataSegments(const Bytes& photo, PhotoFormat format) {
  if (format == PhotoFormat::kJpeg) return MetadataOfJpeg(photo);
  return format == PhotoFormat::kPng ? ExifOfPng(photo) : Bytes();
}

Bytes Shrink(const Bytes& bytes, const PhotoHeader& header, int max_size_px) {
  const Result<cv::Mat> decoded = DecodePhoto(bytes);
  if (!decoded.ok()) return bytes;
  cv::Mat image = *decoded;
  const int orientation = ReadOrientation(bytes, header.format);
  if (header.format == PhotoFormat::kTiff) {
    image = UprightView(image, orientation);  // its orientation is lost below
  } else if (IsMirrored(orientation)) {
    cv::flip(image, image, 1);  // as stored, as the orientation stays
  }
  const double scale = static_cast<double>(max_size_px) / std::max(image.cols, image.rows);
  cv::Mat small;
  const cv::Size size(std::max(1, cvRound(image.cols * scale)),
                      std::max(1, cvRound(image.rows * scale)));
  cv::resize(image, small, size, 0, 0, cv::INTER_AREA);
  Bytes jpeg;
  cv::imencode(".jpg", small, jpeg, {cv::IMWRITE_JPEG_QUALITY, kJpegQuality});
  const Bytes metadata = MetadataSegments(bytes, header.format);
  jpeg.insert(jpeg.begin() + 2, metadata.begin(), metadata.end());
  return jpeg;
}

bool IsSmallEnough(const PhotoHeader& header) { return NumPixels(header) <= kMaxPixels; }

// As it is with max_size_px 0, where it is small enough already, or where it has no header.
Bytes ShrinkTo(int max_size_px, Bytes bytes) {
  if (max_size_px <= 0) return bytes;
  const Result<PhotoHeader> header = ReadPhotoHeader(bytes);
  if (!header.ok()) return bytes;
  const bool is_larger = std::max(header->width_px, header->height_px) > max_size_px;
  return is_larger && IsSmallEnough(*header) ? Shrink(bytes, *header, max_size_px) : bytes;
}

using Counts = std::map<std::string, int>;

// "12 .heic, 3 .mp4, 7 others"; most first.
std::string Text(const Counts& counts) {
  std::vector<std::pair<std::string, int>> kinds(counts.begin(), counts.end());
  std::stable_sort(kinds.begin(), kinds.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  std::string text;
  int num_untold = 0;
  for (size_t i = 0; i < kinds.size(); ++i) {
    const auto& [kind, count] = kinds[i];
    if (i >= kMaxKindsTold) {
      num_untold += count;
      continue;
    }
    text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + kind;
  }
  return num_untold > 0 ? text + ", " + std::to_string(num_untold) + " others" : text;
}

// Photos at or below the path; links are not followed.
int CountPhotos(const fs::path& path) {
  std::error_code error;
  if (fs::is_regular_file(path, error)) return IsPhotoName(path) ? 1 : 0;
  if (fs::is_symlink(path, error)) return 0;
  int count = 0;
  const auto options = fs::directory_options::skip_permission_denied;
  fs::recursive_directory_iterator entry(path, options, error);
  for (; !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    std::error_code vanished;
    count += IsPhotoName(entry->path()) && entry->is_regular_file(vanished) ? 1 : 0;
  }
  return count;
}

// By the folder's name. macOS keeps a file "._NAME" beside NAME on foreign disks.
Counts CountSkipped(const std::vector<fs::path>& skipped) {
  Counts counts;
  for (const fs::path& path : skipped) {
    const int count = CountPhotos(path);
    if (count == 0) continue;
    std::error_code error;
    const std::string name = path.filename().string();
    const bool is_folder = fs::is_directory(path, error);
    const std::string file = name.rfind("._", 0) == 0 ? "._*" : Printable(name);
    counts[is_folder ? "in " + Printable(name) : file] += count;
  }
  return counts;
}

std::vector<fs::path> PhotosOf(const FolderWalk& walk) {
  std::vector<fs::path> photos;
  std::copy_if(walk.files.begin(), walk.files.end(), std::back_inserter(photos), IsPhotoName);
  return photos;
}

Counts CountCompanions(std::vector<fs::path> photos) {
  Counts counts;
  for (const fs::path& path : TakeCompanions(&photos)) ++counts[KindOfCompanion(path)];
  return counts;
}

std::string NamesOf(std::vector<fs::path> paths, const fs::path& folder) {
  std::sort(paths.begin(), paths.end());
  std::string names;
  for (size_t i = 0; i < std::min(paths.size(), kMaxKindsTold); ++i) {
    names += (names.empty() ? "" : ", ") + Printable(paths[i].lexically_relative(folder).string());
  }
  const size_t num_untold = paths.size() - std::min(paths.size(), kMaxKindsTold);
  return num_untold > 0 ? names + ", " + std::to_string(num_untold) + " others" : names;
}

}  // namespace

Result<PhotoOrder> ParsePhotoOrder(const std::string& text) {
  if (text == "name") return PhotoOrder{PhotoOrder::Kind::kName, 0};
  if (text == "time") return PhotoOrder{PhotoOrder::Kind::kTime, 0};
  const std::string prefix = "shuffle:";
  const std::string seed = text.substr(std::min(text.size(), prefix.size()));
  const bool is_number = !seed.empty() && seed.size() < 19 &&
                         seed.find_first_not_of("0123456789") == std::string::npos;
  if (text.compare(0, prefix.size(), prefix) != 0 || !is_number) {
    return InvalidArgument("order must be name, time or shuffle:SEED, not '" + text + "'");
  }
  return PhotoOrder{PhotoOrder::Kind::kShuffle, std::stoull(seed)};
}

std::vector<PhotoFile> ListPhotos(const fs::path& folder, const PhotoOrder& order) {
  std::vector<fs::path> paths = PhotosOf(WalkFolder(folder));
  TakeCompanions(&paths);
  std::vector<PhotoFile> photos;
  for (const fs::path& path : paths) {
    photos.push_back({path, path.lexically_relative(folder).string()});
  }
  std::sort(photos.begin(), photos.end(),
            [](const PhotoFile& a, const PhotoFile& b) { return a.name < b.name; });
  if (order.kind == PhotoOrder::Kind::kTime) SortByTime(&photos);
  if (order.kind == PhotoOrder::Kind::kShuffle) Shuffle(&photos, order.seed);
  return photos;
}

OtherFiles FindOtherFiles(const fs::path& folder) {
  OtherFiles others;
  const FolderWalk walk = WalkFolder(folder);
  Counts kinds;
  for (const fs::path& path : walk.files) {
    if (IsPhotoName(path)) continue;
    const std::string extension = LowerExtension(path);
    ++kinds[extension.empty() ? "without an extension" : Printable(extension)];
    others.have_heif = others.have_heif || IsHeif(path);
  }
  others.kinds = Text(kinds);
  others.companions = Text(CountCompanions(PhotosOf(walk)));
  others.skipped = Text(CountSkipped(walk.skipped));
  others.repeated = NamesOf(walk.repeated, folder);
  others.dangling = NamesOf(walk.dangling, folder);
  others.unreadable = NamesOf(walk.unreadable, folder);
  return others;
}

std::vector<PhotoToOffer> ToOffer(const std::vector<PhotoFile>& photos, int max_size_px,
                                  PhotoReader read) {
  std::vector<PhotoToOffer> offers;
  for (const PhotoFile& photo : photos) {
    PhotoToOffer offer;
    offer.name = photo.name;
    offer.read = [path = photo.path, max_size_px, read] { return read(path, max_size_px); };
    offers.push_back(std::move(offer));
  }
  return offers;
}

Result<Bytes> ReadPhoto(const fs::path& path, int max_size_px) {
  Result<Bytes> bytes = ReadFile(path.string());
  return bytes.ok() ? ShrinkTo(max_size_px, *std::move(bytes)) : bytes;
}

Result<Bytes> ReadWholePhoto(const fs::path& path, int max_size_px) {
  Result<Bytes> bytes = ReadFile(path.string());
  if (!bytes.ok()) return bytes;
  const Result<PhotoHeader> header = ReadPhotoHeader(*bytes);
  if (!header.ok()) return header.status();
  if (IsSmallEnough(*header)) {
    if (Status whole = CheckDecodes(*bytes, *header); !whole.ok()) return whole;
  }
  return ShrinkTo(max_size_px, *std::move(bytes));
}

}  // namespace skein
