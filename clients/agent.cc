#include "clients/agent.h"

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <set>

#include "clients/client_node.h"
#include "clients/folder_watch.h"
#include "clients/other_files.h"
#include "clients/photo_folder.h"
#include "clients/progress_bar.h"
#include "clients/subcommand.h"
#include "clients/trouble_watch.h"
#include "clients/video/video_photos.h"
#include "core/clock.h"
#include "core/counted.h"
#include "node/publisher.h"
#include "photo/heif.h"
#include "photo/photo_name.h"

namespace skein {
namespace {

constexpr int kExitRefused = 3;
constexpr double kRescanS = 1;
constexpr double kLookForTroublesS = 1;

struct AgentOptions {
  ClientOptions client;
  PublisherOptions publisher;
  int max_size_px = 0;  // longest side sent; 0: as they are
  std::string images;
  std::string order = "name";
  bool watch = false;
  std::string video;
  FramePickerOptions frames;
};

// Counts, and what to say at the end.
class Summary {
 public:
  // `waits`: what cannot be read wholly yet is no refusal, as it may change.
  explicit Summary(bool waits) : waits_(waits) {}

  void Add(const PublishedPhoto& photo) {
    if (waits_ && photo.status == image_ack_t::REFUSED && photo.blob_id.empty()) {
      return AddWaiting(photo);
    }
    waiting_.erase(photo.name);
    // A file that was only touched is decided again, and alike.
    if (!decided_.emplace(photo.name, photo.blob_id).second) return;
    ++counts_[photo.status];
    if (photo.status == image_ack_t::REFUSED) {
      std::cerr << "refused " << Printable(photo.name) << ": " << photo.reason << std::endl;
    }
  }
  bool all_taken() const { return Count(image_ack_t::REFUSED) == 0 && waiting_.empty(); }
  void Print(const std::string& agent) const {
    std::cout << agent << ": " << Counted(Count(image_ack_t::STORED), "photo") << " received, "
              << Counted(Count(image_ack_t::DUPLICATE), "duplicate") << ", "
              << Count(image_ack_t::REFUSED) << " refused";
    if (!waiting_.empty()) std::cout << ", " << waiting_.size() << " never became whole";
    std::cout << std::endl;
    for (const auto& [name, reason] : waiting_) {
      std::cerr << "not taken: " << Printable(name) << ": " << reason << std::endl;
    }
  }

 private:
  void AddWaiting(const PublishedPhoto& photo) {
    if (!waiting_.insert_or_assign(photo.name, photo.reason).second) return;
    std::cerr << "not taken yet: " << Printable(photo.name) << ": " << photo.reason
              << "; it is looked at again when it changes" << std::endl;
  }
  int Count(int8_t status) const {
    const auto found = counts_.find(status);
    return found == counts_.end() ? 0 : found->second;
  }

  const bool waits_;
  std::map<int8_t, int> counts_;
  std::set<std::pair<std::string, std::string>> decided_;  // name, blob id
  std::map<std::string, std::string> waiting_;             // name -> reason
};

std::optional<int> ParseAgentOptions(int argc, char** argv, AgentOptions* options) {
  CLI::App app(
      "Sends the photos of a folder to a session, or sharp frames of a video. What is there\n"
      "already is skipped.",
      "skein agent");
  AddClientOptions(app, &options->client);
  app.add_option("--name", options->publisher.agent,
                 "Name of the agent, e.g. alice; required, but with --invite (the invitation's)");
  app.add_option("--images", options->images,
                 "Folder of JPEG, PNG or TIFF photos, with its subfolders; with --video where its "
                 "photos are kept")
      ->required();
  app.add_option("--video", options->video,
                 "FILE (or a series of images, frame_%04d.jpg), URL of a stream, or /dev/videoN");
  app.add_option("--min-motion", options->frames.min_motion,
                 "Of a video: least motion between photos, as a share of the longest side")
      ->capture_default_str();
  app.add_option("--max-motion", options->frames.max_motion,
                 "The most; the sharpest frame in between is taken")
      ->capture_default_str();
  app.add_option("--min-overlap", options->frames.min_overlap,
                 "Share of a photo's points that must be found again, else a photo is taken")
      ->capture_default_str();
  app.add_option("--min-sharpness", options->frames.min_sharpness,
                 "Leave out frames with less than this share of their neighbours' sharpness")
      ->capture_default_str();
  app.add_option("--rate", options->publisher.rate_hz,
                 "Photos a second (default: as fast as they are taken)")
      ->check(AtLeastZero());
  app.add_option("--order", options->order, "name, time or shuffle:SEED")->capture_default_str();
  app.add_option("--max-size", options->max_size_px,
                 "Shrink photos to this longest side in pixels before sending (default: as is)")
      ->check(CLI::Range(64, 100000));
  app.add_option(
         "--focal", options->publisher.focal_px,
         "Focal length in pixels at full resolution, where EXIF tells none (a video's frames)")
      ->check(AtLeastZero());
  app.add_flag(
      "--watch", options->watch,
      "Go on with photos that appear or change, until Ctrl-C; one that is not whole yet is "
      "waited for");
  app.footer(
      "Hidden files and folders, and those that hold thumbnails and trash (@eaDir, Thumbs,\n"
      "__MACOSX, ...), are skipped and counted. So are depth maps and masks (PNG, TIFF) beside\n"
      "their photo: 1_depth.png, masks/1.png.\n"
      "Exit codes: 0 every photo is received or a duplicate, 1 error or interrupted,\n"
      "2 bad usage, 3 some were refused (each is told with its reason).");
  return ParseOptions(&app, argc, argv);
}

// Says of this agent's photos, as soon as the session knows, that they are in no map, and what to
// do.
class Advice {
 public:
  Advice(Node& node, const std::string& agent)
      : bus_(node.bus()),
        subscription_(bus_.Subscribe<photo_diagnosis_t>(
            kPhotoDiagnosisChannel, [this, agent, session = node.session_id()](const auto& told) {
              if (told.session_id == session && told.agent == agent) Tell(told);
            })) {}
  ~Advice() { bus_.Unsubscribe(subscription_); }
  Advice(const Advice&) = delete;
  Advice& operator=(const Advice&) = delete;

 private:
  void Tell(const photo_diagnosis_t& told) {
    const auto [known, is_new] = causes_.try_emplace(told.image_id, told.cause);
    if (!is_new && known->second == told.cause) return;
    known->second = told.cause;
    const std::string name = Printable(told.name);
    if (told.cause == photo_diagnosis_t::PLACED) {
      std::cout << name << " is in the map now" << std::endl;
      return;
    }
    std::cout << name << " is not in the map: " << Printable(told.what);
    if (!told.remedy.empty()) std::cout << "; " << Printable(told.remedy);
    std::cout << std::endl;
  }

  Bus& bus_;
  Bus::SubscriptionId subscription_;
  std::map<int64_t, int8_t> causes_;
};

Status ProvideFolder(const AgentOptions& options) {
  std::error_code error;
  if (!options.video.empty()) std::filesystem::create_directories(options.images, error);
  if (error) return InvalidArgument("--images: cannot create " + options.images);
  if (std::filesystem::is_directory(options.images, error)) return Status::Ok();
  return InvalidArgument("--images: there is no folder " + options.images);
}

// Photos that a former run took from the video are in the folder already.
std::unique_ptr<VideoPhotos> OpenVideo(const AgentOptions& options, PollLoop& loop,
                                       const std::vector<PhotoFile>& photos, Publisher* publisher) {
  if (options.video.empty()) return nullptr;
  std::set<std::string> known;
  for (const PhotoFile& photo : photos) known.insert(photo.name);
  return std::make_unique<VideoPhotos>(
      loop, options.video, options.images, options.frames, std::move(known),
      [publisher, max_size_px = options.max_size_px](const std::vector<PhotoFile>& taken) {
        publisher->Add(ToOffer(taken, max_size_px));
      });
}

void TellNoPhotos(const std::string& folder, const OtherFiles& others) {
  std::cerr << "skein agent: no photos in " << folder << ": JPEG, PNG and TIFF are taken"
            << (others.kinds.empty() ? "" : ", not " + others.kinds)
            << (others.skipped.empty() ? "" : "; skipped: " + others.skipped)
            << "; for a video give --video FILE"
            << (others.have_heif ? std::string(". HEIC: ") + kHeifAdvice : "") << std::endl;
}

bool IsFolder(const std::string& path) {
  std::error_code error;
  return std::filesystem::is_directory(path, error);
}

// Offers what appears or changes in the folder, and tells when the folder vanishes and comes back.
void LookAgain(const AgentOptions& options, FolderWatch* watch, Publisher* publisher) {
  const bool was_gone = watch->is_gone();
  const std::vector<PhotoFile> photos = watch->Scan();
  if (watch->is_gone() != was_gone) {
    std::cerr << "skein agent: " << options.images
              << (was_gone ? " is there again" : " has vanished; waiting for it") << std::endl;
  }
  for (const PhotoFile& photo : photos) {
    if (photo.has_changed) std::cout << Printable(photo.name) << " has changed" << std::endl;
  }
  publisher->Add(ToOffer(photos, options.max_size_px, ReadWholePhoto));
}

int Publish(AgentOptions options, const PhotoOrder& order) {
  const auto node = MakeAgentNode(options.client, &options.publisher.agent);
  const std::vector<PhotoFile> photos = ListPhotos(options.images, order);
  const bool may_grow = options.watch || !options.video.empty();
  const OtherFiles others = FindOtherFiles(options.images);
  if (photos.empty() && !may_grow) {
    TellNoPhotos(options.images, others);
    return kExitError;
  }
  OtherFilesTeller other_files(options.images, std::cerr);
  other_files.Tell(others);
  ProgressBar bar(options.publisher.agent, static_cast<int64_t>(photos.size()));
  FolderWatch watch(options.images, order);
  watch.Skip(photos);
  Summary summary(options.watch);
  const Advice advice(*node, options.publisher.agent);
  Publisher publisher(*node, options.publisher, [&](const PublishedPhoto& photo) {
    summary.Add(photo);
    if (!may_grow) bar.Add();
  });
  publisher.Add(ToOffer(photos, options.max_size_px, options.watch ? ReadWholePhoto : ReadPhoto));
  TroubleWatch troubles(*node);
  node->loop().AddTimer(kLookForTroublesS, [&] { troubles.TellChange("skein agent", std::cerr); });
  if (options.watch) {
    node->loop().AddTimer(kRescanS, [&] {
      LookAgain(options, &watch, &publisher);
      other_files.LookAgain(MonotonicS());
    });
  }
  const auto video = OpenVideo(options, node->loop(), photos, &publisher);
  const auto done = [&] { return !options.watch && publisher.done() && (!video || video->done()); };
  while (!done() && !node->loop().interrupted()) node->loop().RunUntil(done, kRescanS);
  summary.Print(options.publisher.agent);
  if (video) std::cout << video->Summary() << std::endl;
  if (!IsFolder(options.images)) {
    std::cerr << "skein agent: " << options.images << " has vanished" << std::endl;
  }
  if (!publisher.done() || (video && !video->done() && !video->is_live())) {
    std::cerr << "skein agent: interrupted before all photos were received; run it again to go on"
              << std::endl;
    return kExitError;
  }
  return summary.all_taken() ? kExitOk : kExitRefused;
}

}  // namespace

int RunAgent(int argc, char** argv) {
  AgentOptions options;
  if (const auto exit_code = ParseAgentOptions(argc, argv, &options)) return *exit_code;
  const Result<PhotoOrder> order = ParsePhotoOrder(options.order);
  const bool is_named = options.client.node.invite.empty() || !options.publisher.agent.empty();
  const Status name = !is_named                         ? Status::Ok()
                      : options.publisher.agent.empty() ? InvalidArgument("--name is required")
                                                        : CheckAgentName(options.publisher.agent);
  for (const Status& status :
       {order.status(), name, options.frames.Check(), ProvideFolder(options)}) {
    if (status.ok()) continue;
    std::cerr << "skein agent: " << status.error() << std::endl;
    return kExitUsage;
  }
  return Publish(options, *order);
}

}  // namespace skein
