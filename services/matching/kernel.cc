#include "matching/kernel.h"

#if defined(__x86_64__)
#include <cpuid.h>
#include <sys/syscall.h>
#include <unistd.h>
#elif defined(__aarch64__)
#include <sys/auxv.h>
#endif

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <new>
#include <stdexcept>

#include "core/option_check.h"
#include "matching/kernel_block.h"

namespace skein {
namespace {

constexpr int kAlignment = 64;
constexpr int32_t kMaxPartSq = (1 << 16) - 1;  // of a descriptor, see CompactDescriptors
constexpr int32_t kMaxDistanceSq = 4 * kMaxPartSq;
constexpr int32_t kNoDistance = std::numeric_limits<int32_t>::max();
constexpr double kRatioUnit = 1e6;
constexpr uint8_t kNoDescriptor[kDescriptorDim] = {};  // of columns that fill up a panel

constexpr int kAhead = 8;  // columns to fetch before they are packed

int RoundUp(int value, int multiple) { return (value + multiple - 1) / multiple * multiple; }

KernelFormat FormatOf(KernelVersion version) {
  switch (version) {
#if defined(__x86_64__)
    case KernelVersion::kAvx512Vnni:
      return {16, kAvx512PanelColumns, 4, ProcessBlockAvx512Vnni};
    case KernelVersion::kAmx:
      return {16, kAvx512PanelColumns, 4, ProcessBlockAmx};
    case KernelVersion::kAvx2:
      return {8, kAvx2PanelColumns, 4, ProcessBlockAvx2};
#elif defined(__aarch64__)
    case KernelVersion::kNeon:
      return {4, kNeonPanelColumns, 2, ProcessBlockNeon};
    case KernelVersion::kNeonDot:
      return {4, kNeonPanelColumns, 4, ProcessBlockNeonDot};
#endif
    default:
      return {1, kPortablePanelColumns, kDescriptorDim, ProcessBlockPortable};
  }
}

// Memory for vector loads; grows, never shrinks, keeps no content.
template <typename T>
class AlignedBuffer {
 public:
  T* Resize(size_t count) {
    if (count > capacity_) {
      const size_t bytes = (count * sizeof(T) + kAlignment - 1) / kAlignment * kAlignment;
      data_.reset(static_cast<T*>(std::aligned_alloc(kAlignment, bytes)));
      if (!data_) throw std::bad_alloc();
      capacity_ = count;
    }
    return data_.get();
  }
  T* data() const { return data_.get(); }

 private:
  struct Free {
    void operator()(void* p) const { std::free(p); }
  };
  std::unique_ptr<T, Free> data_;
  size_t capacity_ = 0;
};

// A part's columns lie apart in memory.
void Prefetch(const uint8_t* descriptor) {
  __builtin_prefetch(descriptor);
  __builtin_prefetch(descriptor + kDescriptorDim / 2);
}

// Sum of the squares of the dimensions k with k mod 4 < 2 (`part` 0), or of the others (2).
int32_t PartSq(const uint8_t* descriptor, int part) {
  int32_t sum = 0;
  for (int k = part; k < kDescriptorDim; k += 4) {
    sum += descriptor[k] * descriptor[k] + descriptor[k + 1] * descriptor[k + 1];
  }
  return sum;
}

// Nearest neighbour and distance of the next one.
struct Nearest {
  int32_t best_sq = kNoDistance;
  int32_t best_index = -1;
  int32_t second_sq = kNoDistance;

  void Insert(int32_t distance_sq, int32_t index) {
    const bool nearer = distance_sq < best_sq || (distance_sq == best_sq && index < best_index);
    second_sq = std::min(second_sq, nearer ? best_sq : distance_sq);
    if (nearer) {
      best_sq = distance_sq;
      best_index = index;
    }
  }

  void InsertSecond(int32_t distance_sq) { second_sq = std::min(second_sq, distance_sq); }
};

class NearestTest {
 public:
  explicit NearestTest(const MatchOptions& options)
      : ratio_sq_(std::llround(options.max_ratio * options.max_ratio * kRatioUnit)),
        max_distance_sq_(options.max_distance_sq) {}

  bool Passes(const Nearest& nearest) const {
    if (nearest.best_index < 0 || nearest.best_sq > max_distance_sq_) return false;
    if (ratio_sq_ == 0 || nearest.second_sq == kNoDistance) return true;
    return nearest.best_sq * static_cast<int64_t>(kRatioUnit) < nearest.second_sq * ratio_sq_;
  }

  // 1 for duplicates.
  static float RatioSq(const Nearest& nearest) {
    if (nearest.second_sq == kNoDistance) return 0;
    if (nearest.second_sq == 0) return 1;
    return static_cast<float>(nearest.best_sq) / static_cast<float>(nearest.second_sq);
  }

 private:
  int64_t ratio_sq_;
  int32_t max_distance_sq_;
};

#if defined(__x86_64__)
// By CPUID, leaf 7, EDX: bit 24 AMX-TILE, 25 AMX-INT8.
bool HasAmx() {
  unsigned eax = 0, ebx = 0, ecx = 0, edx = 0;
  constexpr unsigned kTileAndInt8 = 3U << 24;
  return __get_cpuid_count(7, 0, &eax, &ebx, &ecx, &edx) != 0 &&
         (edx & kTileAndInt8) == kTileAndInt8;
}

// Linux lets a process use tiles only after it has asked (Documentation/arch/x86/xstate.rst).
bool MayUseTiles() {
  constexpr int kRequestPermission = 0x1023;  // ARCH_REQ_XCOMP_PERM
  constexpr int kTileData = 18;               // XFEATURE_XTILEDATA
  return syscall(SYS_arch_prctl, kRequestPermission, kTileData) == 0;
}
#endif

}  // namespace

std::string KernelName(KernelVersion version) {
  switch (version) {
    case KernelVersion::kPortable:
      return "portable";
    case KernelVersion::kAvx2:
      return "avx2";
    case KernelVersion::kAvx512Vnni:
      return "avx512vnni";
    case KernelVersion::kAmx:
      return "amx";
    case KernelVersion::kNeon:
      return "neon";
    case KernelVersion::kNeonDot:
      return "neondot";
  }
  throw std::invalid_argument("unknown kernel version");
}

bool IsKernelSupported(KernelVersion version) {
#if defined(__x86_64__)
  if (version == KernelVersion::kAmx) {
    static const bool is_permitted = HasAmx() && MayUseTiles();
    return is_permitted && IsKernelSupported(KernelVersion::kAvx512Vnni);
  }
  if (version == KernelVersion::kAvx512Vnni) {
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
           __builtin_cpu_supports("avx512vnni");
  }
  if (version == KernelVersion::kAvx2) return __builtin_cpu_supports("avx2");
#elif defined(__aarch64__)
  if (version == KernelVersion::kNeonDot) return (getauxval(AT_HWCAP) & HWCAP_ASIMDDP) != 0;
  if (version == KernelVersion::kNeon) return true;
#endif
  return version == KernelVersion::kPortable;
}

KernelVersion FastestKernel() {
  return *std::find_if(kKernelVersions.rbegin(), kKernelVersions.rend(), IsKernelSupported);
}

std::vector<uint8_t> CompactDescriptors(std::vector<uint8_t> descriptors) {
  for (uint8_t& value : descriptors) value /= 2;
  for (size_t i = 0; i < descriptors.size(); i += kDescriptorDim) {
    uint8_t* descriptor = descriptors.data() + i;
    if (std::max(PartSq(descriptor, 0), PartSq(descriptor, 2)) <= kMaxPartSq) continue;
    std::fill(descriptor, descriptor + kDescriptorDim, 0);
  }
  return descriptors;
}

int32_t NormSq(const uint8_t* descriptor) { return PartSq(descriptor, 0) + PartSq(descriptor, 2); }

void DotProducts(KernelVersion version, const uint8_t* a, const uint8_t* descriptors,
                 const std::vector<uint32_t>& indices, std::vector<int32_t>* dots) {
  dots->resize(indices.size());
  const DotTask task{a, descriptors, indices.data(), static_cast<int>(indices.size()),
                     dots->data()};
  switch (version) {
#if defined(__x86_64__)
    case KernelVersion::kAmx:
    case KernelVersion::kAvx512Vnni:
      return ProcessDotsAvx512Vnni(task);
    case KernelVersion::kAvx2:
      return ProcessDotsAvx2(task);
#elif defined(__aarch64__)
    case KernelVersion::kNeonDot:
      return ProcessDotsNeonDot(task);
    case KernelVersion::kNeon:
      return ProcessDotsNeon(task);
#endif
    default:
      return ProcessDotsPortable(task);
  }
}

Status MatchOptions::Check() const {
  if (!IsKernelSupported(kernel)) {
    return InvalidArgument("this processor does not run kernel " + KernelName(kernel));
  }
  return InRange("max_ratio", max_ratio, 0.0, 1.0);
}

class DescriptorMatcher::Workspace {
 public:
  explicit Workspace(KernelVersion version) : format_(FormatOf(version)) {}

  // Then rows() and columns() are of these sets, and of the parts since.
  void Begin(const DescriptorView& first, const DescriptorView& second) {
    first_ = first;
    second_ = second;
    rows_.assign(first.count, Nearest());
    columns_.assign(second.count, Nearest());
    row_norm_sq_ = NormsOf(first, &measured_rows_);
    column_norm_sq_ = NormsOf(second, &measured_columns_);
  }

  void Run(const ProductPart& part) {
    if (part.rows.count == 0 || part.columns.count == 0) return;
    part_ = part;
    PackRows();
    PackColumns();
    const int block_columns = kBlockVectors * format_.lanes;
    for (int column = 0; column < part.columns.count; column += block_columns) {
      const int num_columns = std::min(block_columns, part.columns.count - column);
      for (int row = 0; row < part.rows.count; row += kBlockRows) {
        ProcessBlock(row, std::min(kBlockRows, part.rows.count - row), column, num_columns);
      }
    }
  }

  const std::vector<Nearest>& rows() const { return rows_; }
  const std::vector<Nearest>& columns() const { return columns_; }

 private:
  const uint8_t* Row(uint32_t i) const { return first_.data + size_t{kDescriptorDim} * i; }
  const uint8_t* Column(uint32_t j) const { return second_.data + size_t{kDescriptorDim} * j; }

  // Those of the view, else `measured`.
  static const int32_t* NormsOf(const DescriptorView& view, std::vector<int32_t>* measured) {
    if (view.norm_sq != nullptr) return view.norm_sq;
    measured->resize(view.count);
    for (int i = 0; i < view.count; ++i) {
      (*measured)[i] = NormSq(view.data + size_t{kDescriptorDim} * i);
    }
    return measured->data();
  }

  void PackRows() {
    const int count = part_.rows.count;
    const size_t size = static_cast<size_t>(count) * kDescriptorDim;
    const size_t padded = static_cast<size_t>(RoundUp(count, kAmxTileRows)) * kDescriptorDim;
    uint8_t* packed = packed_rows_.Resize(padded);
    row_keys_.Resize(count);
    for (int i = 0; i < count; ++i) {
      const uint8_t* row = Row(part_.rows.data[i]);
      std::copy(row, row + kDescriptorDim, packed + static_cast<size_t>(i) * kDescriptorDim);
      row_keys_.data()[i] = row_norm_sq_[part_.rows.data[i]] * 256 + i % kBlockRows;
    }
    std::fill(packed + size, packed + padded, 0);
  }

  void PackColumns() {
    const int count = part_.columns.count, padded = RoundUp(count, format_.panel_columns);
    packed_columns_.Resize(static_cast<size_t>(padded) * kDescriptorDim);
    column_keys_.Resize(padded);
    for (int j = 0; j < padded; ++j) {
      const int32_t vector = j / format_.lanes % kBlockVectors;
      const uint32_t column = j < count ? part_.columns.data[j] : 0;
      column_keys_.data()[j] =
          (j < count ? column_norm_sq_[column] : kPaddingNormSq) * 256 + vector;
      if (j + kAhead < count) Prefetch(Column(part_.columns.data[j + kAhead]));
      PackColumn(j < count ? Column(column) : kNoDescriptor, j);
    }
  }

  void PackColumn(const uint8_t* descriptor, int j) {
    switch (format_.group) {
      case 4:
        return PackColumn<4>(descriptor, j);
      case 2:
        return PackColumn<2>(descriptor, j);
      default:
        static_assert(kPortablePanelColumns == 1);
        return PackColumn<kDescriptorDim>(descriptor, j);
    }
  }

  template <int kGroup>
  void PackColumn(const uint8_t* descriptor, int j) const {
    const int panel_columns = format_.panel_columns;  // in a register: `out` may point anywhere
    const size_t panel = static_cast<size_t>(j / panel_columns) * panel_columns;
    uint8_t* out = packed_columns_.data() + panel * kDescriptorDim + j % panel_columns * kGroup;
    for (int k = 0; k < kDescriptorDim; k += kGroup, out += panel_columns * kGroup) {
      std::memcpy(out, descriptor + k, kGroup);  // the compiler would move bytes one by one
    }
  }

  void ProcessBlock(int row, int num_rows, int column, int num_columns) {
    const int padded = RoundUp(num_columns, format_.panel_columns);
    const size_t row_states = static_cast<size_t>(num_rows) * format_.lanes;
    BlockTask task;
    task.rows = packed_rows_.data() + static_cast<size_t>(row) * kDescriptorDim;
    task.columns = packed_columns_.data() + static_cast<size_t>(column) * kDescriptorDim;
    task.row_keys = row_keys_.data() + row;
    task.column_keys = column_keys_.data() + column;
    task.row_best = row_best_.Resize(row_states);
    task.row_second = row_second_.Resize(row_states);
    task.column_best = column_best_.Resize(padded);
    task.column_second = column_second_.Resize(padded);
    task.num_rows = num_rows;
    task.num_panels = padded / format_.panel_columns;
    for (int32_t* state : {task.row_best, task.row_second}) {
      std::fill(state, state + row_states, kNoKey);
    }
    for (int32_t* state : {task.column_best, task.column_second}) {
      std::fill(state, state + padded, kNoKey);
    }
    format_.process(task);
    const uint32_t* rows = part_.rows.data + row;
    const uint32_t* columns = part_.columns.data + column;
    for (int i = 0; i < num_rows; ++i) TakeRow(task, i, columns, &rows_[rows[i]]);
    for (int j = 0; j < num_columns; ++j) TakeColumn(task, j, rows, &columns_[columns[j]]);
  }

  void TakeRow(const BlockTask& task, int i, const uint32_t* columns, Nearest* nearest) const {
    const int32_t norm_sq = task.row_keys[i] >> 8;
    for (int lane = 0; lane < format_.lanes; ++lane) {
      const int32_t best = task.row_best[i * format_.lanes + lane];
      const int32_t second = task.row_second[i * format_.lanes + lane];
      if (best >> 8 == kPaddingNormSq) continue;
      nearest->Insert((best >> 8) + norm_sq, columns[(best & 255) * format_.lanes + lane]);
      if (second >> 8 != kPaddingNormSq) nearest->InsertSecond((second >> 8) + norm_sq);
    }
  }

  void TakeColumn(const BlockTask& task, int j, const uint32_t* rows, Nearest* nearest) const {
    const int32_t vector = task.column_keys[j] & 255;
    const int32_t best = task.column_best[j] - vector;
    const int32_t second = task.column_second[j] - vector;
    nearest->Insert(best >> 8, rows[best & 255]);
    if (second >> 8 <= kMaxDistanceSq) nearest->InsertSecond(second >> 8);
  }

  KernelFormat format_;
  DescriptorView first_, second_;
  ProductPart part_;
  const int32_t *row_norm_sq_ = nullptr, *column_norm_sq_ = nullptr;
  std::vector<int32_t> measured_rows_, measured_columns_;
  AlignedBuffer<uint8_t> packed_rows_, packed_columns_;
  AlignedBuffer<int32_t> row_keys_, column_keys_;
  AlignedBuffer<int32_t> row_best_, row_second_, column_best_, column_second_;
  std::vector<Nearest> rows_, columns_;
};

DescriptorMatcher::DescriptorMatcher(const MatchOptions& options) : options_(options) {
  ThrowUnlessSound(options_.Check());
  workspace_ = std::make_unique<Workspace>(options_.kernel);
}

DescriptorMatcher::~DescriptorMatcher() = default;

DescriptorMatcher::DescriptorMatcher(DescriptorMatcher&& other) noexcept = default;

std::vector<IndexPair> DescriptorMatcher::Match(const DescriptorView& first,
                                                const DescriptorView& second) {
  const int count = std::max({0, first.count, second.count});
  for (int i = static_cast<int>(all_.size()); i < count; ++i) all_.push_back(i);
  return MatchParts(first, second, {{{all_.data(), first.count}, {all_.data(), second.count}}});
}

std::vector<IndexPair> DescriptorMatcher::MatchParts(const DescriptorView& first,
                                                     const DescriptorView& second,
                                                     const std::vector<ProductPart>& parts) {
  for (const DescriptorView& view : {first, second}) {
    if (view.count < 0 || (view.count > 0 && !view.data)) {
      throw std::invalid_argument("descriptors without data or with a negative count");
    }
  }
  workspace_->Begin(first, second);
  for (const ProductPart& part : parts) workspace_->Run(part);
  const NearestTest test(options_);
  std::vector<IndexPair> matches;
  for (int i = 0; i < first.count; ++i) {
    const Nearest& row = workspace_->rows()[i];
    if (!test.Passes(row)) continue;
    const Nearest& column = workspace_->columns()[row.best_index];
    if (column.best_index != i || !test.Passes(column)) continue;
    matches.push_back({static_cast<uint32_t>(i), static_cast<uint32_t>(row.best_index),
                       std::max(NearestTest::RatioSq(row), NearestTest::RatioSq(column))});
  }
  return matches;
}

}  // namespace skein
