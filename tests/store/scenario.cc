// store_scenario KIND DIR: what the store's tests run under a shim that fails calls or records
// writes.
//
//   write   takes photos into the session DIR, as ingest does: each file is stored, then its
//           fact is committed, then it is acknowledged. Goes on where it stopped.
//   clone   DIR/session to DIR/clone
//   repair  DIR/session
//
// What is acknowledged is printed, a line each; with record_writes.c it is noted in the log, too.
// Exit codes: 0 done, 1 an error that was told, 3 the fault that fail_calls.c was to make did not
// come.
#include "store/scenario.h"

#include <dlfcn.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>

#include "auth/session_keys.h"
#include "clients/store/session_clone.h"
#include "clients/store/session_repair.h"
#include "core/hash.h"
#include "ingest/ledger_writer.h"
#include "ingest/photo_store.h"
#include "ledger/fact_ids.h"
#include "ledger/photo_file.h"
#include "ledger/session_folder.h"

namespace {

using namespace skein;
using namespace skein::store_test;

// Of a shim, if it is there.
template <class Function>
Function* Of(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_DEFAULT, name));
}

void Acknowledge(const std::string& what) {
  if (auto* note = Of<void(const char*)>("skein_note")) note(what.c_str());
  const std::string line = kAcknowledged + what + "\n";
  if (::write(STDOUT_FILENO, line.data(), line.size()) < 0) _exit(2);
}

// A call that fails is repeated by ingest at its next turn; a scenario ends after a few.
constexpr int kTries = 3;

void Require(const Status& status) {
  if (!status.ok()) throw std::runtime_error(status.error());
}

void TakePhotos(const std::string& dir) {
  const Result<Session> session = OpenOrCreateSession(dir);
  Require(session.status());
  Require(ClaimSession(*session));
  const auto keys =
      OpenSessionKeys(session->paths.Keys().string(), session->session_id, Role::kIngest, "ingest");
  Require(keys.status());
  Acknowledge("session " + session->session_id);
  Acknowledge("root " + HashBytes(keys->trust.root.data(), keys->trust.root.size()));
  auto ledger = Ledger::Open(session->paths.Ledger());
  Require(ledger.status());
  int64_t time_us = 0;
  LedgerWriter writer(*std::move(ledger), session->session_id, [&] { return ++time_us; });
  for (int number = 1; number <= kNumPhotos; ++number) {
    const Bytes photo = PhotoOf(number);
    image_t image{};
    image.agent = "alice";
    image.name = NameOf(number);
    image.blob_id = HashBytes(photo.data(), photo.size());
    image.header.fact_id = ImageFactId(image.blob_id);
    if (writer.history().FindImageByBlob(image.blob_id) != 0) continue;
    Status stored;
    for (int i = 0; i < kTries; ++i) {
      stored = StorePhoto(session->paths, image.agent, image.name, photo);
      if (stored.ok()) break;
    }
    Require(stored);
    writer.Stage(image, {{"camera", NameOf(number), "1"}},
                 [number](const Fact&) { Acknowledge("photo " + std::to_string(number)); });
    for (int i = 0; i < kTries && writer.has_staged(); ++i) writer.Flush();
    if (writer.has_staged()) throw std::runtime_error(writer.problem());
  }
}

void Clone(const std::string& dir) {
  const auto session = CloneSession({dir + "/session"}, dir + "/clone");
  Require(session.status());
  Acknowledge("clone " + session->session_id);
}

void Repair(const std::string& dir) {
  const auto repaired = RepairSession({dir + "/session"});
  Require(repaired.status());
  for (const std::string& photo : repaired->photos_to_send) Acknowledge("send " + photo);
  Acknowledge("repaired");
}

void Run(const std::string& kind, const std::string& dir) {
  if (kind == "write") return TakePhotos(dir);
  if (kind == "clone") return Clone(dir);
  if (kind == "repair") return Repair(dir);
  throw std::runtime_error("no such kind: " + kind);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: store_scenario KIND DIR\n");
    return 2;
  }
  const std::string kind = argv[1], dir = argv[2];
  if (auto* arm = Of<void()>("skein_arm_faults")) arm();
  int code = 0;
  try {
    Run(kind, dir);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "store_scenario: %s\n", error.what());
    code = 1;
  }
  if (auto* count = Of<long()>("skein_count_faults")) {
    const char* at = std::getenv("SKEIN_FAIL_AT");
    if (code == 0 && at != nullptr && count() < std::atol(at)) code = 3;
  }
  return code;
}
