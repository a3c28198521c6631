#include "clients/agent.h"

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>

#include "clients/client_node.h"
#include "clients/folder_watch.h"
#include "clients/photo_folder.h"
#include "clients/progress_bar.h"
#include "clients/publisher.h"
#include "clients/subcommand.h"
#include "core/clock.h"
#include "photo/photo_name.h"

namespace skein {
namespace {

constexpr int kExitRefused = 3;
constexpr double kRescanS = 1;

struct AgentOptions {
  ClientOptions client;
  PublisherOptions publisher;
  std::string images;
  std::string order = "name";
  bool watch = false;
};

// Counts, and what to say at the end.
class Summary {
 public:
  void Add(const PublishedPhoto& photo) {
    ++counts_[photo.status];
    if (photo.status == image_ack_t::REFUSED) {
      std::cerr << "refused " << Printable(photo.name) << ": " << photo.reason << std::endl;
    }
  }
  int refused() const { return Count(image_ack_t::REFUSED); }
  void Print(const std::string& agent) const {
    std::cout << agent << ": " << Count(image_ack_t::STORED) << " stored, "
              << Count(image_ack_t::DUPLICATE) << " duplicates, " << refused() << " refused"
              << std::endl;
  }

 private:
  int Count(int8_t status) const {
    const auto found = counts_.find(status);
    return found == counts_.end() ? 0 : found->second;
  }
  std::map<int8_t, int> counts_;
};

std::optional<int> ParseAgentOptions(int argc, char** argv, AgentOptions* options) {
  CLI::App app("Publishes the photos of a folder to a session. What is there already is skipped.",
               "skein agent");
  AddClientOptions(app, &options->client);
  app.add_option("--name", options->publisher.agent,
                 "Name of the agent, e.g. alice; with --invite that of the invitation");
  app.add_option("--images", options->images, "Folder of JPEG, PNG or TIFF photos")
      ->required()
      ->check(CLI::ExistingDirectory);
  app.add_option("--rate", options->publisher.rate_hz,
                 "Photos a second (default: as fast as they are taken)")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--order", options->order, "name, time or shuffle:SEED")->capture_default_str();
  app.add_option("--max-size", options->publisher.max_size_px,
                 "Shrink photos to this longest side in pixels before sending (default: as is)")
      ->check(CLI::Range(64, 100000));
  app.add_flag("--watch", options->watch, "Go on with photos that appear, until Ctrl-C");
  app.footer(
      "Exit codes: 0 every photo is stored or a duplicate, 1 error or interrupted,\n"
      "2 bad usage, 3 some were refused (each is told with its reason).");
  return ParseCommandLine(app, argc, argv);
}

int Publish(AgentOptions options, const PhotoOrder& order) {
  const auto node = MakeAgentNode(options.client, &options.publisher.agent);
  std::vector<PhotoFile> photos = ListPhotos(options.images, order);
  if (photos.empty() && !options.watch) {
    std::cerr << "skein agent: no photos in " << options.images << std::endl;
    return kExitError;
  }
  ProgressBar bar(options.publisher.agent, static_cast<int64_t>(photos.size()));
  FolderWatch watch(options.images, order);
  watch.Skip(photos);
  Summary summary;
  Publisher publisher(*node, options.publisher, [&](const PublishedPhoto& photo) {
    summary.Add(photo);
    if (!options.watch) bar.Add();
  });
  publisher.Add(std::move(photos));
  if (options.watch) node->loop().AddTimer(kRescanS, [&] { publisher.Add(watch.Scan()); });
  const auto done = [&] { return !options.watch && publisher.done(); };
  while (!done() && !node->loop().interrupted()) node->loop().RunUntil(done, kRescanS);
  summary.Print(options.publisher.agent);
  if (!publisher.done()) {
    std::cerr << "skein agent: interrupted before all photos were taken; run it again to go on"
              << std::endl;
    return kExitError;
  }
  return summary.refused() > 0 ? kExitRefused : kExitOk;
}

}  // namespace

int RunAgent(int argc, char** argv) {
  AgentOptions options;
  if (const auto exit_code = ParseAgentOptions(argc, argv, &options)) return *exit_code;
  const Result<PhotoOrder> order = ParsePhotoOrder(options.order);
  const bool is_named = options.client.node.invite.empty() || !options.publisher.agent.empty();
  const Status name = is_named ? CheckAgentName(options.publisher.agent) : Status::Ok();
  if (!order.ok() || !name.ok()) {
    std::cerr << "skein agent: " << (order.ok() ? name.error() : order.error()) << std::endl;
    return kExitUsage;
  }
  return Publish(options, *order);
}

}  // namespace skein
