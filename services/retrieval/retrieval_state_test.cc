#include "retrieval/retrieval_state.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <random>
#include <set>

#include "core/file.h"
#include "testing/test_folder.h"

namespace skein::retrieval_state_test {

constexpr size_t kDim = 32;

std::vector<float> RandomUnit(std::mt19937* random) {
  std::normal_distribution<float> normal;
  std::vector<float> v(kDim);
  float sum = 0;
  for (float& x : v) {
    x = normal(*random);
    sum += x * x;
  }
  for (float& x : v) x /= std::sqrt(sum);
  return v;
}

std::vector<std::vector<float>> RandomUnits(size_t count) {
  std::mt19937 random(5);
  std::vector<std::vector<float>> all;
  for (size_t i = 0; i < count; ++i) all.push_back(RandomUnit(&random));
  return all;
}

std::vector<int64_t> Ids(const std::vector<Neighbour>& neighbours) {
  std::vector<int64_t> ids;
  for (const auto& n : neighbours) ids.push_back(n.id);
  return ids;
}

GlobalDescriptor Descriptor(const std::vector<float>& values, const std::string& model = "m") {
  return {model, values};
}

TEST(HnswIndex, FindsWhatExactSearchFinds) {
  const auto vectors = RandomUnits(600);
  HnswOptions exact_options;
  exact_options.exact = true;
  HnswIndex index(kDim, {});
  HnswIndex exact(kDim, exact_options);
  size_t found = 0;
  size_t wanted = 0;
  for (size_t i = 0; i < vectors.size(); ++i) {
    const auto truth = Ids(exact.Query(vectors[i].data(), 30));
    const auto ids = Ids(index.Query(vectors[i].data(), 30));
    const std::set<int64_t> set(ids.begin(), ids.end());
    for (const int64_t id : truth) found += set.count(id);
    wanted += truth.size();
    index.Insert(static_cast<int64_t>(i) + 1, vectors[i].data());
    exact.Insert(static_cast<int64_t>(i) + 1, vectors[i].data());
  }
  EXPECT_GE(static_cast<double>(found) / static_cast<double>(wanted), 0.99);
}

// Photos of a place have a cosine of about 0.4, those of two places about none.
class Places {
 public:
  static constexpr size_t kDim = 256;

  std::vector<float> Photo(const std::vector<float>& place) {
    std::vector<float> photo = Random();
    for (size_t i = 0; i < kDim; ++i) photo[i] += 0.8f * place[i];
    return photo;
  }
  std::vector<float> Random() {
    std::normal_distribution<float> normal(0, 1 / std::sqrt(static_cast<float>(kDim)));
    std::vector<float> v(kDim);
    for (float& x : v) x = normal(random_);
    return v;
  }

 private:
  std::mt19937 random_{17};
};

TEST(HnswIndex, FindsAPlaceAmongMoreThanASearchCanVisit) {
  constexpr int64_t kNumPlaces = 500;
  constexpr int64_t kPhotosAPlace = 20;
  HnswOptions options;
  options.ef_search = 20;  // as few of 10,000 as the usual breadth of a million
  options.ef_construction = 20;
  HnswIndex index(Places::kDim, options);
  Places places;
  std::vector<std::vector<float>> queries;
  for (int64_t place = 0; place < kNumPlaces; ++place) {
    const auto centre = places.Random();
    for (int64_t i = 0; i < kPhotosAPlace; ++i) {
      index.Insert(place * kPhotosAPlace + i, places.Photo(centre).data());
    }
    queries.push_back(places.Photo(centre));
  }
  size_t found = 0;
  for (int64_t place = 0; place < kNumPlaces; ++place) {
    for (const auto& n : index.Query(queries[place].data(), kPhotosAPlace)) {
      found += n.id / kPhotosAPlace == place;
    }
  }
  EXPECT_GE(static_cast<double>(found), 0.92 * kNumPlaces * kPhotosAPlace) << "exact: 0.9865";
}

TEST(HnswIndex, SearchesALargeIndexMoreBroadly) {
  EXPECT_EQ(SearchBreadth(200, 0), 200u);
  EXPECT_EQ(SearchBreadth(200, 100'000), 200u);
  EXPECT_EQ(SearchBreadth(200, 1'000'000), 400u);
  EXPECT_EQ(SearchBreadth(50, 10'000'000), 150u);
}

TEST(HnswIndex, TellsEuclideanDistancesNearestFirst) {
  HnswIndex index(2, {});
  const float origin[] = {0, 0};
  const float near[] = {0, 1};
  const float far[] = {3, 4};
  index.Insert(7, far);
  index.Insert(9, near);
  const auto found = index.Query(origin, 5);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].id, 9);
  EXPECT_NEAR(found[0].distance, 1, 1e-3);
  EXPECT_NEAR(found[1].distance, 5, 2 * 4. / 127);
}

TEST(HnswIndex, TellsTheDistanceOfVectorsOfAnyDimension) {
  std::mt19937 random(11);
  std::normal_distribution<float> normal;
  for (const size_t dim : {1, 15, 16, 31, 32, 33, 100, 1024}) {
    std::vector<float> a(dim), b(dim);
    for (float& value : a) value = normal(random);
    for (float& value : b) value = normal(random);
    const float distance =
        std::sqrt(Int8DistanceSq(ToInt8(a.data(), dim).data(), ToInt8(b.data(), dim).data(), &dim));
    HnswIndex index(dim, {});
    index.Insert(1, a.data());
    EXPECT_FLOAT_EQ(index.Query(b.data(), 1).at(0).distance, distance);
    EXPECT_FLOAT_EQ(index.QueryExact(b.data(), 1).at(0).distance, distance);
  }
}

TEST(HnswIndex, GrowsByDoubling) {
  HnswOptions options;
  options.ef_search = options.ef_construction = 1;
  HnswIndex index(kDim, options);
  const auto vectors = RandomUnits(kInitialCapacity + 1);
  for (size_t i = 0; i < vectors.size(); ++i)
    index.Insert(static_cast<int64_t>(i), vectors[i].data());
  EXPECT_EQ(index.capacity(), 2 * kInitialCapacity);
  EXPECT_EQ(index.QueryExact(vectors.back().data(), 1).at(0).id, int64_t{kInitialCapacity});
}

TEST(HnswIndex, LeavesRemovedOnesOutUntilRestored) {
  HnswIndex index(kDim, {});
  const auto vectors = RandomUnits(20);
  for (size_t i = 0; i < vectors.size(); ++i)
    index.Insert(static_cast<int64_t>(i), vectors[i].data());
  index.Remove(3);
  index.Remove(3);
  index.Remove(99);
  EXPECT_NE(index.Query(vectors[3].data(), 1).at(0).id, 3);
  index.Restore(3);
  EXPECT_EQ(index.Query(vectors[3].data(), 1).at(0).id, 3);
}

TEST(HnswIndex, RefusesTheSameIdTwiceAndASearchOlderThanTheIndex) {
  HnswIndex index(1, {});
  const float one = 1;
  const auto search = index.Find(&one);
  index.Insert(1, search);
  EXPECT_THROW(index.Insert(1, &one), std::invalid_argument);
  EXPECT_THROW(index.Insert(2, search), std::invalid_argument);
}

TEST(HnswIndex, OneSearchServesQueryAndInsertion) {
  HnswIndex together(kDim, {});
  HnswIndex apart(kDim, {});
  const auto vectors = RandomUnits(400);
  for (size_t i = 0; i < vectors.size(); ++i) {
    const auto id = static_cast<int64_t>(i);
    const auto search = together.Find(vectors[i].data());
    EXPECT_EQ(Ids(together.Nearest(search, 30)), Ids(apart.Query(vectors[i].data(), 30)));
    together.Insert(id, search);
    apart.Insert(id, vectors[i].data());
  }
  EXPECT_EQ(together.Encode(), apart.Encode());
}

TEST(HnswIndex, PhotosInsertedWhileAllOthersAreRemovedAreFound) {
  HnswIndex index(kDim, {});
  const auto vectors = RandomUnits(60);
  for (int64_t id = 0; id < 30; ++id) index.Insert(id, vectors[id].data());
  for (int64_t id = 0; id < 30; ++id) index.Remove(id);
  EXPECT_TRUE(index.Query(vectors[0].data(), 5).empty());
  for (int64_t id = 30; id < 60; ++id) index.Insert(id, vectors[id].data());
  for (int64_t id = 30; id < 60; ++id) {
    EXPECT_EQ(index.Query(vectors[id].data(), 1).at(0).id, id);
  }
  for (int64_t id = 0; id < 30; ++id) index.Restore(id);
  for (int64_t id = 0; id < 60; ++id) {
    EXPECT_EQ(index.Query(vectors[id].data(), 1).at(0).id, id);
  }
}

// Unit vector at an angle from the first axis towards another.
std::vector<float> At(double angle_deg, size_t axis) {
  const double angle_rad = angle_deg * M_PI / 180;
  std::vector<float> v(4, 0.f);
  v[0] = static_cast<float>(std::cos(angle_rad));
  v[axis] = static_cast<float>(std::sin(angle_rad));
  return v;
}

TEST(HnswIndex, ExpandedQueryPrefersThoseLikeItsNearest) {
  HnswIndex index(4, {});
  index.Insert(1, At(30, 1).data());
  index.Insert(2, At(50, 1).data());
  index.Insert(3, At(47, 2).data());
  const auto search = index.Find(At(0, 1).data());
  EXPECT_EQ(Ids(index.Nearest(search, 3)), std::vector<int64_t>({1, 3, 2}));
  EXPECT_EQ(Ids(index.NearestExpanded(search, 3, 0)), std::vector<int64_t>({1, 3, 2}));
  const auto expanded = index.NearestExpanded(search, 3, 1);
  EXPECT_EQ(Ids(expanded), std::vector<int64_t>({1, 2, 3}));
  EXPECT_NEAR(expanded[1].distance, 2 * std::sin(25 * M_PI / 180), 0.01) << "the vector's own";
  EXPECT_EQ(Ids(index.NearestExpanded(search, 1, 9)), std::vector<int64_t>({1}));
}

TEST(RetrievalState, PhotoHasThoseBeforeItAsCandidates) {
  RetrievalOptions options;
  options.top_n = 30;
  RetrievalState state(options);
  const auto vectors = RandomUnits(40);
  for (int64_t id = 1; id <= 40; ++id) {
    const auto candidates = state.Add(id, Descriptor(vectors[id - 1]));
    ASSERT_TRUE(candidates.ok());
    EXPECT_EQ(candidates->neighbours.size(), std::min<size_t>(30, id - 1));
    for (const auto& n : candidates->neighbours) EXPECT_LT(n.id, id);
  }
}

TEST(RetrievalState, PhotoWithNothingToDescribeIsNeitherInsertedNorAnswered) {
  RetrievalState state(RetrievalOptions{});
  EXPECT_TRUE(state.Add(1, Descriptor({}))->neighbours.empty());
  EXPECT_EQ(state.size(), 0u);
}

TEST(RetrievalState, KeepsModelsAndDimensionsApart) {
  RetrievalState state(RetrievalOptions{});
  ASSERT_TRUE(state.Add(1, Descriptor({1, 0}, "a")).ok());
  EXPECT_TRUE(state.Add(2, Descriptor({1, 0}, "b"))->neighbours.empty());
  EXPECT_TRUE(state.Add(3, Descriptor({1, 0, 0}, "a"))->neighbours.empty());
  EXPECT_EQ(state.Add(4, Descriptor({0, 1}, "a"))->neighbours.size(), 1u);
  EXPECT_EQ(state.Add(5, Descriptor({0, 1, 0}, "a"))->neighbours.size(), 1u);
  EXPECT_EQ(state.size(), 5u);
  const auto read = RetrievalState::Decode(state.Encode("s"), "s", RetrievalOptions{});
  ASSERT_TRUE(read.ok()) << read.error();
  EXPECT_EQ(read->size(), 5u);
}

TEST(RetrievalState, RefusesValuesThatAreNotFinite) {
  RetrievalState state(RetrievalOptions{});
  EXPECT_FALSE(state.Add(1, Descriptor({NAN, 0})).ok());
  EXPECT_FALSE(state.Add(2, Descriptor({1, HUGE_VALF})).ok());
  EXPECT_EQ(state.size(), 0u);
}

TEST(RetrievalState, WithdrawnPhotoIsNoCandidateUntilItRegistersAgain) {
  RetrievalState state(RetrievalOptions{});
  ASSERT_TRUE(state.Add(1, Descriptor({1, 0})).ok());
  state.NoteRegistered(1, 10);
  state.NoteRegistered(1, 20);
  state.NoteWithdrawn(1, 10);
  EXPECT_EQ(state.Add(2, Descriptor({1, 0}))->neighbours.size(), 1u);
  state.NoteWithdrawn(1, 20);
  EXPECT_EQ(Ids(state.Add(3, Descriptor({1, 0}))->neighbours), std::vector<int64_t>({2}));
  state.NoteRegistered(1, 20);
  EXPECT_EQ(state.Add(4, Descriptor({1, 0}))->neighbours.size(), 3u);
}

TEST(RetrievalState, PhotoThatWasGivenUpIsNoCandidate) {
  RetrievalState state(RetrievalOptions{});
  ASSERT_TRUE(state.Add(1, Descriptor({1, 0})).ok());
  ASSERT_TRUE(state.Add(2, Descriptor({1, 0})).ok());
  state.NoteFailed(1);
  EXPECT_EQ(Ids(state.Add(3, Descriptor({1, 0}))->neighbours), std::vector<int64_t>({2}));
}

// A checkpoint's hash says nothing of who wrote it.
TEST(HnswIndex, AGraphWithAnyChangedByteIsRefusedOrSafe) {
  const auto vectors = RandomUnits(300);
  HnswIndex index(kDim, {});
  for (size_t i = 0; i < vectors.size(); ++i) {
    index.Insert(static_cast<int64_t>(i), index.Find(vectors[i].data()));
  }
  const Bytes whole = index.Encode();
  std::mt19937_64 random(7);
  int num_refused = 0;
  for (int trial = 0; trial < 1500; ++trial) {
    Bytes changed = whole;
    // The header, of 96 bytes, as often as the rest.
    const size_t at = random() % (trial % 2 == 0 ? 96 : whole.size());
    changed[at] = static_cast<uint8_t>(random());
    Result<HnswIndex> loaded = HnswIndex::Decode(changed, kDim, {});
    num_refused += !loaded.ok();
    if (loaded.ok())
      loaded->Insert(123456789, loaded->Find(vectors[static_cast<size_t>(trial) % 300].data()));
  }
  EXPECT_GT(num_refused, 800);
  EXPECT_TRUE(HnswIndex::Decode(whole, kDim, {}).ok());
  EXPECT_FALSE(HnswIndex::Decode(whole, kDim + 1, {}).ok());
}

TEST(HnswIndex, BreadthOfSearchHoldsAlsoAfterLoading) {
  HnswOptions options;
  options.ef_search = options.ef_construction = 1;  // finds few of the nearest
  const auto vectors = RandomUnits(400);
  HnswIndex index(kDim, options);
  for (size_t i = 0; i < vectors.size(); ++i) {
    index.Insert(static_cast<int64_t>(i), vectors[i].data());
  }
  options.ef_search = 400;
  const auto loaded = HnswIndex::Decode(index.Encode(), kDim, options);
  ASSERT_TRUE(loaded.ok());
  const auto query = RandomUnits(401).back();
  EXPECT_EQ(Ids(loaded->Query(query.data(), 30)), Ids(loaded->QueryExact(query.data(), 30)));
}

class Checkpoint : public testing::Test {
 protected:
  Checkpoint() : vectors_(RandomUnits(300)), state_(RetrievalOptions{}) {
    for (int64_t id = 1; id <= 200; ++id) Add(id, &state_);
    state_.set_seq(777);
    state_.NoteRegistered(5, 1);
    state_.NoteWithdrawn(5, 1);
    state_.unanswered()[200] = Candidates{200, {{4, 0.5f}}, 0.25f, 0.125f};
    bytes_ = state_.Encode("session");
  }

  std::vector<Neighbour> Add(int64_t id, RetrievalState* state) {
    return state->Add(id, Descriptor(vectors_[id - 1]))->neighbours;
  }
  Result<RetrievalState> Decode(const Bytes& bytes, const std::string& session = "session") {
    return RetrievalState::Decode(bytes, session, {});
  }

  std::vector<std::vector<float>> vectors_;
  RetrievalState state_;
  Bytes bytes_;
};

TEST_F(Checkpoint, GoesOnAsIfItHadNeverStopped) {
  auto loaded = Decode(bytes_);
  ASSERT_TRUE(loaded.ok()) << loaded.error();
  EXPECT_EQ(loaded->seq(), 777);
  EXPECT_EQ(loaded->size(), 200u);
  ASSERT_EQ(loaded->unanswered().count(200), 1u);
  EXPECT_EQ(loaded->unanswered()[200].neighbours.at(0).id, 4);
  for (int64_t id = 201; id <= 300; ++id) {
    EXPECT_EQ(Ids(Add(id, &*loaded)), Ids(Add(id, &state_))) << id;
  }
  state_.set_seq(778);
  loaded->set_seq(778);
  EXPECT_EQ(loaded->Encode("session").size(), state_.Encode("session").size());
}

TEST_F(Checkpoint, AnyFlippedByteIsNoticed) {
  for (size_t i = 0; i < bytes_.size(); i += 97) {
    Bytes damaged = bytes_;
    damaged[i] ^= 0x10;
    EXPECT_FALSE(Decode(damaged).ok()) << "byte " << i;
  }
}

TEST_F(Checkpoint, TruncationIsNoticed) {
  for (const size_t size :
       {size_t{0}, size_t{3}, size_t{60}, bytes_.size() / 2, bytes_.size() - 1}) {
    EXPECT_FALSE(Decode(Bytes(bytes_.begin(), bytes_.begin() + size)).ok()) << size;
  }
}

// The writer may be killed at any time: the file is the old state or the new one.
TEST_F(Checkpoint, KilledWhileItIsWrittenTheOldOneOrTheNewOneIsThere) {
  const TestFolder folder;
  const std::string path = folder / "hnsw.bin";
  ASSERT_TRUE(WriteFileAtomic(path, bytes_).ok());
  std::mt19937 random(7);
  std::set<int64_t> seen;
  for (int round = 0; round < 40; ++round) {
    const pid_t writer = ::fork();
    if (writer == 0) {
      for (int64_t seq = 1000;; ++seq) {
        state_.set_seq(seq);
        WriteFileAtomic(path, state_.Encode("session"));
      }
    }
    ASSERT_GT(writer, 0);
    // The first writer gets to the end of a write.
    for (int ms = 0; round == 0 && ms < 60'000 && *ReadFile(path) == bytes_; ++ms) ::usleep(1000);
    ::usleep(random() % 20000);
    ASSERT_EQ(::kill(writer, SIGKILL), 0);
    ASSERT_EQ(::waitpid(writer, nullptr, 0), writer);
    const auto bytes = ReadFile(path);
    ASSERT_TRUE(bytes.ok());
    const auto state = Decode(*bytes);
    ASSERT_TRUE(state.ok()) << state.error();
    EXPECT_EQ(state->size(), 200u);
    seen.insert(state->seq());
  }
  EXPECT_GT(seen.size(), 1u) << "no writer got to the end of a write";
}

TEST_F(Checkpoint, VersionFromTheFutureAndAnotherSessionAreRefused) {
  EXPECT_NE(Decode(bytes_, "other").error().find("another session"), std::string::npos);
  Bytes future = bytes_;
  future[4] = 99;
  EXPECT_NE(Decode(future).error().find("version 99"), std::string::npos);
}

}  // namespace skein::retrieval_state_test
