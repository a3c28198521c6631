#pragma once

#include <functional>
#include <vector>

#include "event_loop/alive.h"
#include "ingest/diagnosis_teller.h"
#include "ingest/finish_driver.h"
#include "ingest/garbage.h"
#include "ingest/ingest_options.h"
#include "ingest/ledger_writer.h"
#include "ingest/listening_clock.h"
#include "ingest/photo_intake.h"
#include "ingest/submission_desk.h"
#include "ingest/work_desk.h"
#include "node/ledger_server.h"
#include "node/node.h"

namespace skein {

// The session's one writer: connects the bus with intake, submissions, work, finish and the
// ledger's readers. Everything it knows is in the ledger. Loop's thread only.
class IngestService {
 public:
  // Opens the ledger of the node's session folder and replays it. Throws std::runtime_error, with a
  // line for the user, if it cannot.
  IngestService(Node& node, const IngestOptions& options);
  ~IngestService();
  IngestService(const IngestService&) = delete;
  IngestService& operator=(const IngestService&) = delete;

 private:
  template <class T>
  void On(const Channel<T>& channel, std::function<void(const T&)> handler);
  template <class T>
  void OnSubmissions(const Channel<T>& channel);
  Clock Listened() const {
    return [this] { return listening_.now_s(); };
  }
  void Subscribe();
  void NoteConfiguration();
  void ArrangeFlush();
  void Flush();
  void Tick();
  void TellActivity();
  std::string ReadyState() const;
  void FillHeartbeat(heartbeat_t* heartbeat) const;

  Node& node_;
  ListeningClock listening_;  // by which others are silent
  LedgerWriter writer_;
  LedgerServer server_;
  PhotoIntake intake_;
  SubmissionDesk submissions_;
  WorkDesk work_;
  FinishDriver finish_;
  GarbageCollector garbage_;
  DiagnosisTeller diagnoses_;
  std::vector<Bus::SubscriptionId> subscriptions_;
  PollLoop::TimerId timer_ = 0;
  Alive alive_;  // of posted functions
};

}  // namespace skein
