#include "web/metrics.h"

#include <gtest/gtest.h>

#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "session/report.h"
#include "testing/test_ledger.h"
#include "web/prometheus_text.h"
#include "web/status_message.h"

namespace skein::metrics_test {

using nlohmann::json;

std::vector<std::string> LinesOf(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

TEST(PrometheusText, WritesFamiliesWithHelpTypeAndSamples) {
  PrometheusText text;
  text.Begin("skein_a_total", MetricType::kCounter, "A line\nand a \\.");
  text.Add(3);
  text.Begin("skein_b", MetricType::kGauge, "B.");
  text.Add(0.25, {{"stage", "x"}, {"step", "y"}});
  EXPECT_EQ(text.text(),
            "# HELP skein_a_total A line\\nand a \\\\.\n"
            "# TYPE skein_a_total counter\n"
            "skein_a_total 3\n"
            "# HELP skein_b B.\n"
            "# TYPE skein_b gauge\n"
            "skein_b{stage=\"x\",step=\"y\"} 0.25\n");
}

TEST(PrometheusText, LabelsBreakNoLine) {
  PrometheusText text;
  text.Begin("skein_a", MetricType::kGauge, "A.");
  text.Add(1, {{"host", "a\"b\\c\nd\xff"}});
  EXPECT_EQ(LinesOf(text.text()).back(), R"(skein_a{host="a\"b\\c?d?"} 1)");
  text.Add(1, {{"host", std::string(5000, 'x')}});
  EXPECT_LT(LinesOf(text.text()).back().size(), 200u);
}

TEST(PrometheusText, NumbersReadBackAsTheSame) {
  PrometheusText text;
  text.Begin("skein_a", MetricType::kGauge, "A.");
  for (const double value : {1e15, 123456789012.0, 0.1, 1.0 / 3, -2.5}) {
    text.Add(value);
    EXPECT_EQ(std::stod(LinesOf(text.text()).back().substr(8)), value);
  }
  text.Add(std::numeric_limits<double>::infinity());
  EXPECT_EQ(LinesOf(text.text()).back(), "skein_a +Inf");
  text.Add(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(LinesOf(text.text()).back(), "skein_a NaN");
}

TEST(PrometheusText, AHistogramIsCumulative) {
  PrometheusText text;
  text.Begin("skein_s", MetricType::kHistogram, "S.");
  text.AddHistogram(std::vector<double>{0.5, 1}, std::vector<int64_t>{2, 0, 3}, 7.5);
  EXPECT_EQ(LinesOf(text.text()),
            (std::vector<std::string>{"# HELP skein_s S.", "# TYPE skein_s histogram",
                                      "skein_s_bucket{le=\"0.5\"} 2", "skein_s_bucket{le=\"1\"} 2",
                                      "skein_s_bucket{le=\"+Inf\"} 5", "skein_s_sum 7.5",
                                      "skein_s_count 5"}));
}

TEST(PrometheusText, RefusesNamesThatAreNone) {
  for (const char* name : {"", "1a", "a-b", "a b", "a{", "a\n"}) {
    EXPECT_FALSE(IsMetricName(name)) << name;
    EXPECT_THROW(PrometheusText().Begin(name, MetricType::kGauge, ""), std::invalid_argument);
  }
  EXPECT_THROW(PrometheusText().Begin("a", MetricType::kCounter, ""), std::invalid_argument);
  EXPECT_THROW(PrometheusText().Begin("a_total", MetricType::kGauge, ""), std::invalid_argument);
  PrometheusText twice;
  twice.Begin("a", MetricType::kGauge, "");
  EXPECT_THROW(twice.Begin("a", MetricType::kGauge, ""), std::invalid_argument);
}

// A session of nine photos in every state, and its processes.
class MetricsTest : public testing::Test, protected TestLedger {
 protected:
  MetricsTest() {
    for (int64_t id = 1; id <= 9; ++id) {
      image_t image{};
      image.image_id = id;
      image.size_bytes = 100;
      image.received_utime_us = 1'000'000 * (head() + 1) - 250'000;
      Commit(image);
      if (id <= 7) Describe(id);
      if (id <= 5) Match(id);
    }
    Seed(50, 0, 0);
    for (const int64_t id : {1, 2, 3}) Register(50, id, registration_t::REGISTERED);
    Register(50, 4, registration_t::REJECTED);
    failure_t parked{};
    parked.image_id = 8;
    parked.stage = "features";
    parked.parked = 1;
    Commit(parked);
    failure_t refused{};
    refused.stage = "ingest";
    Commit(refused);
    merge_t failed{};
    failed.state = merge_t::FAILED;
    Commit(failed);
    for (const char* name : {"features-1", "features-2", "mapper-1"}) {
      heartbeat_t beat{};
      beat.instance = name;
      beat.service = std::string(name).substr(0, std::string(name).find('-'));
      beat.host = "laptop";
      beat.memory_bytes = 1 << 30;
      beat.backlog = 2;
      processes_[name] = {beat, 0, 0};
    }
  }
  void Describe(int64_t id) {
    features_t features{};
    features.image_id = id;
    features.local_s = 0.5F;
    features.global_s = 0.25F;
    Commit(features);
  }
  void Match(int64_t id) {
    candidates_t candidates{};
    candidates.image_id = id;
    Commit(candidates);
    matches_t matches{};
    matches.image_id = id;
    matches.num_tried = 4;
    matches.pairs_blob = "blob";
    Commit(matches);
  }
  void Register(int64_t submap_id, int64_t id, int8_t state) {
    registration_t registration{};
    registration.submap_id = submap_id;
    registration.image_id = id;
    registration.state = state;
    registration.total_s = 0.125F;
    Commit(registration);
  }

  std::string Text() const {
    return MetricsText({"0123456789abcdef", session(), tally(), processes_,
                        (head() + 10) * 1'000'000, 1, DiskSpace{700, 1000}});
  }
  // Samples by their name and labels.
  std::map<std::string, double> Samples() const {
    std::map<std::string, double> samples;
    for (const std::string& line : LinesOf(Text())) {
      if (line.front() == '#') continue;
      const size_t space = line.rfind(' ');
      const bool is_new =
          samples.emplace(line.substr(0, space), std::stod(line.substr(space + 1))).second;
      EXPECT_TRUE(is_new) << line;
    }
    return samples;
  }

  HeardProcesses processes_;
};

// Grammar of the format, version 0.0.4, for lines without a timestamp.
TEST_F(MetricsTest, EachLineIsOfTheFormat) {
  const std::regex comment("# (HELP [a-z_]+ [^\n]+|TYPE [a-z_]+ (counter|gauge|histogram))");
  const std::regex sample(
      R"re([a-z_]+(\{[a-z]+="([^"\\]|\\["\\n])*"(,[a-z]+="([^"\\]|\\["\\n])*")*\})? [-+0-9.eInfa]+)re");
  for (const std::string& line : LinesOf(Text())) {
    EXPECT_TRUE(std::regex_match(line, line.front() == '#' ? comment : sample)) << line;
  }
  EXPECT_EQ(Text().back(), '\n');
}

TEST_F(MetricsTest, NamesAreSkeinsWithBaseUnits) {
  for (const std::string& line : LinesOf(Text())) {
    if (line.compare(0, 7, "# TYPE ") != 0) continue;
    const std::string name = line.substr(7, line.rfind(' ') - 7);
    EXPECT_EQ(name.compare(0, 6, "skein_"), 0) << name;
    EXPECT_FALSE(std::regex_search(name, std::regex("_(ms|us|kb|mb|percent|px)(_|$)"))) << name;
  }
}

TEST_F(MetricsTest, PhotosAreThoseOfReportAndStatus) {
  std::map<std::string, double> samples = Samples();
  const PhotoCounts counts = CountPhotos(session(), 0);
  const auto photos = [&](const std::string& state) {
    return samples.at("skein_photos{state=\"" + state + "\"}");
  };
  EXPECT_EQ(photos("registered"), counts.registered);
  EXPECT_EQ(photos("failed"), counts.failed);
  EXPECT_EQ(photos("in_flight"), state().num_in_flight());
  EXPECT_EQ(photos("in_flight") + photos("waiting") + photos("unplaced"), counts.deferred);
  EXPECT_EQ(photos("waiting"), 1);
  EXPECT_EQ(photos("unplaced"), 1);
  EXPECT_EQ(samples["skein_photos_accepted_total"], 9);
  EXPECT_EQ(samples["skein_photo_bytes_total"], 900);

  const json status = json::parse(StatusMessage(session(), processes_, 0, {}));
  EXPECT_EQ(photos("registered"), status["photos"]["registered"]);
  EXPECT_EQ(photos("failed"), status["photos"]["failed"]);
  for (const std::string stage : {"features", "retrieval", "matching"}) {
    EXPECT_EQ(samples.at("skein_stage_backlog{stage=\"" + stage + "\"}"), status["backlog"][stage])
        << stage;
  }
}

TEST_F(MetricsTest, StagesAreThoseOfTheReport) {
  std::map<std::string, double> samples = Samples();
  const json stages = MakeReport(session(), 0, 0)["stages"];
  for (const std::string stage : {"ingest", "features", "retrieval", "matching", "mapper"}) {
    const double count = stages[stage]["count"];
    EXPECT_EQ(samples.at("skein_stage_items_total{stage=\"" + stage + "\"}"), count) << stage;
    EXPECT_NEAR(samples.at("skein_stage_seconds_total{stage=\"" + stage + "\"}"),
                count * stages[stage]["mean_s"].get<double>(), 1e-6)
        << stage;
  }
  EXPECT_EQ(samples["skein_stage_items_total{stage=\"merge\"}"], 0);
  EXPECT_NEAR(samples["skein_step_seconds_total{stage=\"features\",step=\"local\"}"], 3.5, 1e-6);
  EXPECT_EQ(samples["skein_pairs_matched_total"], 20);
  EXPECT_EQ(samples["skein_merges_total{result=\"failed\"}"], 1);
}

TEST_F(MetricsTest, TheOldestPhotosAgeIsSinceItCameToItsStage) {
  std::map<std::string, double> samples = Samples();
  // Photo 9 came as the last one; three registrations, a rejection, a seed, two failures and a
  // merge follow.
  EXPECT_EQ(samples["skein_stage_oldest_age_seconds{stage=\"features\"}"], 8 + 10);
  EXPECT_EQ(samples["skein_stage_oldest_age_seconds{stage=\"matching\"}"], 0);
}

TEST_F(MetricsTest, TheLatencyHistogramRisesToItsCount) {
  const std::map<std::string, double> samples = Samples();
  double before = 0, last = 0;
  int num_buckets = 0;
  for (const std::string& line : LinesOf(Text())) {
    if (line.compare(0, 34, "skein_photo_latency_seconds_bucket") != 0) continue;
    last = std::stod(line.substr(line.rfind(' ') + 1));
    EXPECT_GE(last, before) << line;
    before = last;
    ++num_buckets;
  }
  EXPECT_EQ(num_buckets, static_cast<int>(kLatencyBoundsS.size()) + 1);
  EXPECT_EQ(last, samples.at("skein_photo_latency_seconds_count"));
  EXPECT_EQ(last, 3);
  double sum_s = 0;
  for (const double seconds : PhotoToPoseSeconds(session())) sum_s += seconds;
  EXPECT_NEAR(samples.at("skein_photo_latency_seconds_sum"), sum_s, 1e-6);
}

TEST_F(MetricsTest, ProcessesTellTheirMemoryAndStagesTheirWorkers) {
  std::map<std::string, double> samples = Samples();
  EXPECT_EQ(samples["skein_workers{stage=\"features\"}"], 2);
  EXPECT_EQ(samples["skein_workers{stage=\"retrieval\"}"], 0);
  EXPECT_EQ(samples.at("skein_process_resident_memory_bytes{process=\"mapper-1\","
                       "service=\"mapper\",host=\"laptop\"}"),
            1 << 30);
  EXPECT_EQ(samples["skein_disk_available_bytes"], 700);
  EXPECT_EQ(samples["skein_troubles"], 1);
}

// Anyone who may send a heartbeat chooses these names.
TEST_F(MetricsTest, ManyProcessesAndStrangeNamesStayWithinBounds) {
  for (int i = 0; i < 5000; ++i) {
    heartbeat_t beat{};
    beat.service = "service-" + std::to_string(i);
    processes_["a\"\\\n" + std::to_string(i)] = {beat, 0, 0};
  }
  processes_["\x01"] = processes_["\x02"] = {};  // both are printed as "?"
  const std::string text = Text();
  EXPECT_LT(text.size(), 500'000u);
  std::map<std::string, double> samples = Samples();
  EXPECT_EQ(samples["skein_processes_without_series"],
            static_cast<double>(processes_.size() - kMaxProcessSeries));
}

TEST_F(MetricsTest, WhatIsNotKnownIsLeftOut) {
  const SessionRecord none;
  const SessionTally tally;
  const std::string text = MetricsText({"id", none, tally, {}, 0, std::nullopt, std::nullopt});
  EXPECT_EQ(text.find("skein_disk"), std::string::npos);
  EXPECT_EQ(text.find("skein_troubles"), std::string::npos);
  EXPECT_NE(text.find("\nskein_photos_accepted_total 0\n"), std::string::npos);
}

}  // namespace skein::metrics_test
