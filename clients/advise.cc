#include "clients/advise.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "clients/client_node.h"
#include "clients/subcommand.h"
#include "core/clock.h"
#include "photo/photo_name.h"
#include "session/guidance_json.h"

namespace skein {
namespace {

constexpr double kTogetherS = 0.5;     // messages within this time are printed at once
constexpr double kGuidePeriodS = 5.5;  // the guide repeats its messages within this time
constexpr double kAdviceTimeoutS = 20;
constexpr double kForgetToldS = 30;      // advice that the guide does not repeat is dropped
constexpr size_t kMaxToldKept = 10'000;  // submaps, agents
constexpr size_t kMaxSentence = 300;

struct AdviseOptions {
  ClientOptions client;
  std::string agent;
  bool once = false;
  bool json = false;
};

std::optional<int> ParseAdviseOptions(int argc, char** argv, AdviseOptions* options) {
  CLI::App app("Says how complete each place is, and what each agent can photograph next, live.",
               "skein advise");
  AddClientOptions(app, &options->client);
  app.add_option("--agent", options->agent, "Of this agent alone");
  app.add_flag("--once", options->once, "Say it once and end");
  app.add_flag("--json", options->json, "One JSON object a line instead of sentences");
  app.footer("Exit codes: 0 said, 1 error or nothing heard of the guide, 2 bad usage.");
  return ParseOptions(&app, argc, argv);
}

// Latest guidance_t of each submap and advice_t of each agent.
class AdviceWatch {
 public:
  AdviceWatch(Node& node, std::string agent) : node_(node), agent_(std::move(agent)) {
    subscriptions_ = {node.bus().Subscribe(kGuidanceChannel,
                                           [this](const guidance_t& told) {
                                             if (told.session_id != node_.session_id()) return;
                                             guidance_[told.submap_id] = {told, MonotonicS()};
                                           }),
                      node.bus().Subscribe(kAdviceChannel, [this](const advice_t& told) {
                        if (told.session_id != node_.session_id()) return;
                        if (!agent_.empty() && told.agent != agent_) return;
                        advice_[told.agent] = {told, MonotonicS()};
                      })};
  }
  ~AdviceWatch() {
    for (const auto id : subscriptions_) node_.bus().Unsubscribe(id);
  }
  AdviceWatch(const AdviceWatch&) = delete;
  AdviceWatch& operator=(const AdviceWatch&) = delete;

  bool has_heard() const { return agent_.empty() ? !guidance_.empty() : !advice_.empty(); }

  void ForgetOld() {
    Forget(&guidance_);
    Forget(&advice_);
  }
  std::string Text() const;
  std::string Json() const;

 private:
  template <class T>
  struct Heard {
    T message;
    double heard_s = 0;
  };
  template <class Key, class T>
  static void Keep(const Key& key, const T& told, std::map<Key, Heard<T>>* heard) {
    if (heard->size() < kMaxToldKept || heard->count(key) > 0) (*heard)[key] = {told, MonotonicS()};
  }
  template <class Map>
  static void Forget(Map* heard) {
    for (auto entry = heard->begin(); entry != heard->end();) {
      const bool is_old = MonotonicS() - entry->second.heard_s > kForgetToldS;
      entry = is_old ? heard->erase(entry) : std::next(entry);
    }
  }

  Node& node_;
  const std::string agent_;
  std::map<int64_t, Heard<guidance_t>> guidance_;  // by submap
  std::map<std::string, Heard<advice_t>> advice_;  // by agent
  std::vector<Bus::SubscriptionId> subscriptions_;
};

std::string AdviceWatch::Text() const {
  std::string text;
  for (const auto& [submap_id, heard] : guidance_) {
    text += "map " + std::to_string(submap_id) + ": " +
            Printable(heard.message.place.sentence, kMaxSentence) + "\n";
  }
  for (const auto& [agent, heard] : advice_) {
    const advice_t& advice = heard.message;
    text += Printable(agent) + " in map " + std::to_string(advice.submap_id) + ": " +
            (advice.stations.empty() ? "nothing weak is within reach" : "next photos") + "\n";
    int number = 0;
    for (const station_t& station : advice.stations) {
      text +=
          "  " + std::to_string(++number) + ". " + Printable(station.sentence, kMaxSentence) + "\n";
    }
  }
  return text;
}

std::string AdviceWatch::Json() const {
  nlohmann::json submaps = nlohmann::json::array(), advice = nlohmann::json::array();
  for (const auto& [submap_id, heard] : guidance_) submaps.push_back(GuidanceJson(heard.message));
  for (const auto& [agent, heard] : advice_) advice.push_back(AdviceJson(heard.message));
  return nlohmann::json({{"session_id", node_.session_id()},
                         {"submaps", std::move(submaps)},
                         {"advice", std::move(advice)}})
             .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) +
         "\n";
}

}  // namespace

int RunAdvise(int argc, char** argv) {
  AdviseOptions options;
  if (const auto exit_code = ParseAdviseOptions(argc, argv, &options)) return *exit_code;
  const auto node = MakeClientNode("advise", Role::kViewer, options.client);
  AdviceWatch watch(*node, options.agent);
  const auto say = [&] { return options.json ? watch.Json() : watch.Text(); };
  if (options.once) {
    if (!node->loop().RunUntil([&] { return watch.has_heard(); }, kAdviceTimeoutS)) {
      std::cerr << "skein advise: nothing heard of skein-guide"
                << (options.agent.empty() ? "" : " for " + options.agent)
                << "; is the session running, and are its photos in a map?" << std::endl;
      return kExitError;
    }
    // The advice of one agent is one message; all agents' come within the guide's period.
    node->loop().RunUntil([] { return false; }, options.agent.empty() ? kGuidePeriodS : kTogetherS);
    std::cout << say() << std::flush;
    return kExitOk;
  }
  std::string said;
  node->loop().AddTimer(kTogetherS, [&] {
    watch.ForgetOld();
    std::string text = say();
    if (text == said || !watch.has_heard()) return;
    std::cout << text << (options.json ? "" : "\n") << std::flush;
    said = std::move(text);
  });
  node->loop().Run();
  return kExitOk;
}

}  // namespace skein
