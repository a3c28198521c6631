// Prometheus' text exposition format, version 0.0.4.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace skein {

enum class MetricType { kCounter, kGauge, kHistogram };

// A name, of code, and a value, of anything.
using MetricLabels = std::vector<std::pair<std::string_view, std::string>>;

// A name: [a-zA-Z_:][a-zA-Z0-9_:]*.
bool IsMetricName(std::string_view name);

// Families in the order of Begin, each with its HELP, its TYPE and its samples. Label values are
// escaped; bytes that are not UTF-8 and control characters become '?'.
class PrometheusText {
 public:
  // Begins a family. Throws std::invalid_argument for a name that is none or that was begun before,
  // and for a counter whose name does not end with _total.
  void Begin(std::string_view name, MetricType type, std::string_view help);
  // A sample of the family that was begun last.
  void Add(double value, const MetricLabels& labels = {});
  // Samples of a histogram: `counts`, not cumulative, has one more than `upper_bounds`.
  template <class Bounds, class Counts>
  void AddHistogram(const Bounds& upper_bounds, const Counts& counts, double sum) {
    int64_t below = 0;
    for (size_t i = 0; i < counts.size(); ++i) {
      below += counts[i];
      const bool is_last = i == upper_bounds.size();
      AddLine("_bucket", {{"le", is_last ? "+Inf" : NumberText(upper_bounds[i])}},
              static_cast<double>(below));
    }
    AddLine("_sum", {}, sum);
    AddLine("_count", {}, static_cast<double>(below));
  }

  const std::string& text() const { return text_; }

 private:
  // The shortest text that reads back as the same number; "+Inf", "-Inf", "NaN".
  static std::string NumberText(double value);
  void AddLine(std::string_view suffix, const MetricLabels& labels, double value);

  std::string text_, name_;
  std::vector<std::string> begun_;
};

}  // namespace skein
