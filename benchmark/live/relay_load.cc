// Load of a session's relays: a source that serves blobs, and workers that pull them, each a
// process with the BlobClient that every service has. relay_load.sh starts them.
//
//   relay_load serve COUNT MEGABYTES [OPTION...]
//   relay_load pull BLOB... [OPTION...]
//
// serve: prints "blob ID" for each of COUNT blobs, then "ready source". Prints "relay INSTANCE S
//   MESSAGES STATE" for each heartbeat of a relay.
// pull: fetches the blobs again and again, and prints "pulled S BYTES MESSAGES FAILURES" once a
//   second: totals of what came over the bus, and of fetches that failed.
//
// OPTION: as of every service, --session, --invite and so on. S: seconds, monotonic. Both run until
// a signal.

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/clock.h"
#include "core/hash.h"
#include "node/node.h"

namespace skein {
namespace {

constexpr char kSource[] = "source";
// A worker fetches so many blobs at once: with one alone it would wait while the blob is hashed.
constexpr int kFetchesAtOnce = 2;

BlobPtr RandomBlob(int seed, size_t num_bytes) {
  std::mt19937_64 random(static_cast<uint64_t>(seed));
  Bytes bytes(num_bytes);
  for (auto& byte : bytes) byte = static_cast<uint8_t>(random());
  return std::make_shared<const Bytes>(std::move(bytes));
}

void Serve(Node& node, int count, int megabytes) {
  for (int i = 0; i < count; ++i) {
    const BlobPtr blob = RandomBlob(i, static_cast<size_t>(megabytes) * 1'000'000);
    const std::string id = HashBytes(blob->data(), blob->size());
    node.blobs().Keep(id, blob);
    std::printf("blob %s\n", id.c_str());
  }
  node.bus().Subscribe(kHeartbeatChannel, [](const heartbeat_t& beat) {
    if (beat.service != "relay") return;
    std::printf("relay %s %.3f %lld %s\n", beat.instance.c_str(), MonotonicS(),
                static_cast<long long>(beat.num_done), beat.state.c_str());
    std::fflush(stdout);
  });
  node.Run();
}

class Puller {
 public:
  // Workers begin at different blobs.
  Puller(Node& node, std::vector<std::string> blobs)
      : node_(node), blobs_(std::move(blobs)), next_(static_cast<size_t>(::getpid())) {
    for (int i = 0; i < kFetchesAtOnce; ++i) FetchNext();
    node.loop().AddTimer(1, [this] { Print(); });
  }

 private:
  void FetchNext() {
    node_.blobs().Fetch(blobs_[next_++ % blobs_.size()], kSource, [this](const Result<Bytes>& got) {
      if (!got.ok()) ++num_failures_;
      FetchNext();
    });
  }
  void Print() const {
    std::printf("pulled %.3f %lld %lld %d\n", MonotonicS(),
                static_cast<long long>(node_.blobs().bytes_pulled()),
                static_cast<long long>(node_.bus().counters().num_received), num_failures_);
    std::fflush(stdout);
  }

  Node& node_;
  const std::vector<std::string> blobs_;
  size_t next_;
  int num_failures_ = 0;
};

int Run(int argc, char** argv) {
  NodeOptions options;
  options.service = "relay_load";
  options.cache_bytes = 0;  // each fetch comes over the bus
  int count = 0, megabytes = 0;
  std::vector<std::string> blobs;
  CLI::App app("Load of a session's relays", "relay_load");
  app.require_subcommand(1);
  CLI::App* serve = app.add_subcommand("serve", "Serve blobs");
  serve->add_option("count", count, "Blobs")->required()->check(CLI::Range(1, 1000));
  serve->add_option("megabytes", megabytes, "Of each")->required()->check(CLI::Range(1, 1000));
  CLI::App* pull = app.add_subcommand("pull", "Pull blobs");
  pull->add_option("blobs", blobs, "Their names")->required();
  AddCommonOptions(*serve, &options);
  AddCommonOptions(*pull, &options);
  CLI11_PARSE(app, argc, argv);
  if (serve->parsed()) {
    options.instance = kSource;
    return RunService(options, [&](Node& node) { Serve(node, count, megabytes); });
  }
  return RunService(options, [&](Node& node) {
    const Puller puller(node, blobs);
    node.Run();
  });
}

}  // namespace
}  // namespace skein

int main(int argc, char** argv) { return skein::Run(argc, argv); }
