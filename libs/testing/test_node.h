// For tests: an ingest that keeps its ledger in memory, and nodes on one bus.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "node/ledger_server.h"
#include "node/node.h"

namespace skein {

inline NodeOptions TestOptions(const std::string& instance) {
  NodeOptions options;
  options.service = "test";
  options.instance = instance;
  options.session_id = "0123456789abcdef";
  return options;
}

// Drops each received message with the given probability, from a printed seed.
inline std::function<bool(const std::string&)> DropShare(double share, uint64_t seed) {
  testing::Test::RecordProperty("seed", std::to_string(seed));
  auto random = std::make_shared<std::mt19937_64>(seed);
  return [random, share](const std::string&) {
    return std::uniform_real_distribution<>(0, 1)(*random) < share;
  };
}

inline registration_t TestFact(const std::string& fact_id) {
  registration_t fact{};
  fact.header.fact_id = fact_id;
  fact.reason = "reason of " + fact_id;
  return fact;
}

// status: submit_reply_t's REFUSED or NOT_LEASED.
struct RefusedFact {
  int8_t status;
  std::string reason;
};

// Commits what is submitted, once a fact_id, and serves ranges.
class MemoryIngest {
 public:
  explicit MemoryIngest(Node& node)
      : node_(node),
        server_(node, 0, [this](int64_t from, int64_t to, const LedgerServer::Visit& visit) {
          for (int64_t seq = from; seq <= to; ++seq) {
            const Fact& fact = facts_.at(seq - 1);
            if (!visit(FactKind(fact), EncodeFact(fact))) return;
          }
        }) {
    ForEachSubmitChannel([this](auto channel) {
      subscriptions_.push_back(
          node_.bus().Subscribe(channel, [this](const auto& fact) { OnSubmission(Fact(fact)); }));
    });
  }
  ~MemoryIngest() {
    for (const auto id : subscriptions_) node_.bus().Unsubscribe(id);
  }

  int64_t Commit(Fact fact) {
    fact_header_t& header = Header(fact);
    header.session_id = node_.session_id();
    header.seq = static_cast<int64_t>(facts_.size()) + 1;
    header.utime_us = 1;
    if (auto* merge = std::get_if<merge_t>(&fact); merge && merge->state == merge_t::ORDERED) {
      merge->merge_id = header.seq;
    }
    seq_of_[header.fact_id] = header.seq;
    facts_.push_back(fact);
    server_.Broadcast(fact);
    return header.seq;
  }
  // Asked for each fact that is not in the ledger yet.
  void Refuse(std::function<std::optional<RefusedFact>(const Fact&)> judge) {
    judge_ = std::move(judge);
  }

  const std::vector<Fact>& facts() const { return facts_; }
  int num_submissions() const { return num_submissions_; }
  LedgerServer& server() { return server_; }

 private:
  void OnSubmission(const Fact& fact) {
    ++num_submissions_;
    const fact_header_t& header = Header(fact);
    submit_reply_t reply{};
    reply.author = header.author;
    reply.fact_id = header.fact_id;
    reply.status = submit_reply_t::COMMITTED;
    const auto known = seq_of_.find(header.fact_id);
    const std::optional<RefusedFact> refusal =
        known == seq_of_.end() && judge_ ? judge_(fact) : std::nullopt;
    if (refusal) {
      reply.status = refusal->status;
      reply.reason = refusal->reason;
    } else {
      reply.seq = known == seq_of_.end() ? Commit(fact) : known->second;
    }
    node_.Publish(kSubmitReplyChannel, reply);
  }

  Node& node_;
  std::vector<Fact> facts_;
  std::map<std::string, int64_t> seq_of_;
  std::function<std::optional<RefusedFact>(const Fact&)> judge_;
  int num_submissions_ = 0;
  LedgerServer server_;
  std::vector<Bus::SubscriptionId> subscriptions_;
};

}  // namespace skein
