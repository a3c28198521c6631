#include "web/prometheus_text.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <stdexcept>

#include "photo/photo_name.h"

namespace skein {
namespace {

constexpr size_t kMaxLabelBytes = 128;

bool IsNameStart(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || c == ':';
}

// `specials`: escaped by a backslash.
std::string Escaped(std::string_view text, std::string_view specials) {
  std::string escaped;
  for (const char c : text) {
    if (specials.find(c) != std::string_view::npos) escaped += '\\';
    escaped += c == '\n' ? 'n' : c;
  }
  return escaped;
}

const char* TypeName(MetricType type) {
  if (type == MetricType::kCounter) return "counter";
  return type == MetricType::kGauge ? "gauge" : "histogram";
}

bool HasCountersEnding(std::string_view name) {
  constexpr std::string_view kEnding = "_total";
  return name.size() > kEnding.size() && name.substr(name.size() - kEnding.size()) == kEnding;
}

}  // namespace

bool IsMetricName(std::string_view name) {
  return !name.empty() && IsNameStart(name.front()) &&
         std::all_of(name.begin(), name.end(),
                     [](char c) { return IsNameStart(c) || (c >= '0' && c <= '9'); });
}

std::string PrometheusText::NumberText(double value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0 ? "+Inf" : "-Inf";
  char text[32];
  const auto end = std::to_chars(std::begin(text), std::end(text), value);
  return {text, end.ptr};
}

void PrometheusText::Begin(std::string_view name, MetricType type, std::string_view help) {
  const bool is_sound = IsMetricName(name) &&
                        (type == MetricType::kCounter) == HasCountersEnding(name) &&
                        std::find(begun_.begin(), begun_.end(), name) == begun_.end();
  if (!is_sound) throw std::invalid_argument("no name of a new metric: " + std::string(name));
  name_ = name;
  begun_.push_back(name_);
  text_ += "# HELP " + name_ + " " + Escaped(help, "\\\n") + "\n";
  text_ += "# TYPE " + name_ + " " + TypeName(type) + "\n";
}

void PrometheusText::Add(double value, const MetricLabels& labels) { AddLine("", labels, value); }

void PrometheusText::AddLine(std::string_view suffix, const MetricLabels& labels, double value) {
  text_ += name_;
  text_ += suffix;
  char before = '{';
  for (const auto& [name, label] : labels) {
    text_ += before;
    text_ += name;
    text_ += "=\"" + Escaped(Printable(label, kMaxLabelBytes), "\\\"\n") + "\"";
    before = ',';
  }
  if (!labels.empty()) text_ += '}';
  text_ += " " + NumberText(value) + "\n";
}

}  // namespace skein
