#include "blobs/blob_client.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <random>

#include "core/clock.h"
#include "core/hash.h"
#include "testing/test_node.h"

namespace skein::blob_client_test {

Bytes RandomBytes(size_t size, uint64_t seed) {
  std::mt19937_64 random(seed);
  Bytes bytes(size);
  for (uint8_t& byte : bytes) byte = static_cast<uint8_t>(random());
  return bytes;
}

class BlobClientTest : public testing::Test {
 protected:
  // Fetches from "owner" and waits for the answer.
  Result<Bytes> Fetch(const std::string& blob_id, double timeout_s = 20) {
    Result<Bytes> result = Unavailable("no answer in time");
    bool done = false;
    reader_.blobs().Fetch(blob_id, "owner", [&](Result<Bytes> fetched) {
      result = std::move(fetched);
      done = true;
    });
    loop_.RunUntil([&] { return done; }, timeout_s);
    return result;
  }
  Bus::SubscriptionId SubscribeToRequests(const std::string& owner,
                                          std::function<void(const blob_request_t&)> handler) {
    return bus_.Subscribe<blob_request_t>(BlobRequestChannel(owner), std::move(handler));
  }

  PollLoop loop_;
  Bus bus_{"memq://", loop_};
  Node owner_{TestOptions("owner"), loop_, bus_};
  Node reader_{TestOptions("reader"), loop_, bus_};
};

TEST_F(BlobClientTest, PullsBlobsOfAllSizes) {
  const size_t chunk = 24 << 10;
  for (const size_t size : {size_t{0}, size_t{1}, chunk - 1, chunk, chunk + 1, 40 * chunk + 17}) {
    const Bytes bytes = RandomBytes(size, size);
    const Result<Bytes> fetched = Fetch(owner_.blobs().Offer(bytes));
    ASSERT_TRUE(fetched.ok()) << size << ": " << fetched.error();
    EXPECT_EQ(*fetched, bytes) << size;
  }
}

TEST_F(BlobClientTest, PullsUnderTwentyPercentLoss) {
  bus_.SetDropReceived(DropShare(0.2, 3));
  const Bytes bytes = RandomBytes(4 << 20, 1);
  const Result<Bytes> fetched = Fetch(owner_.blobs().Offer(bytes), 60);
  ASSERT_TRUE(fetched.ok()) << fetched.error();
  EXPECT_EQ(*fetched, bytes);
  EXPECT_EQ(reader_.blobs().bytes_pulled(), static_cast<int64_t>(bytes.size()));
}

TEST_F(BlobClientTest, FetchesOfOneBlobShareAPull) {
  const Bytes bytes = RandomBytes(1 << 20, 2);
  const std::string id = owner_.blobs().Offer(bytes);
  int done = 0;
  for (int i = 0; i < 5; ++i) {
    reader_.blobs().Fetch(id, "owner", [&](const Result<Bytes>& fetched) {
      EXPECT_TRUE(fetched.ok() && *fetched == bytes);
      ++done;
    });
  }
  ASSERT_TRUE(loop_.RunUntil([&] { return done == 5; }, 20));
  EXPECT_EQ(reader_.blobs().bytes_pulled(), static_cast<int64_t>(bytes.size()));
}

TEST_F(BlobClientTest, KeepsWhatItFetchedInItsCache) {
  const Bytes bytes = RandomBytes(100000, 3);
  const std::string id = owner_.blobs().Offer(bytes);
  ASSERT_TRUE(Fetch(id).ok());
  owner_.blobs().Release(id);
  ASSERT_TRUE(Fetch(id).ok());
  EXPECT_EQ(reader_.blobs().bytes_pulled(), 100000);
}

TEST_F(BlobClientTest, ManyPullsAtOnceAllEnd) {
  int done = 0;
  for (uint64_t i = 0; i < 30; ++i) {
    const Bytes bytes = RandomBytes(50000 + i, i);
    reader_.blobs().Fetch(owner_.blobs().Offer(bytes), "owner",
                          [&done, bytes](const Result<Bytes>& fetched) {
                            EXPECT_TRUE(fetched.ok() && *fetched == bytes);
                            ++done;
                          });
  }
  ASSERT_TRUE(loop_.RunUntil([&] { return done == 30; }, 30));
}

TEST_F(BlobClientTest, AnswersForAnUnknownBlobWithAnError) {
  const Result<Bytes> fetched = Fetch(HashBytes("x", 1));
  EXPECT_EQ(fetched.code(), StatusCode::kNotFound);
  EXPECT_NE(fetched.error().find("owner has no blob"), std::string::npos) << fetched.error();
}

TEST_F(BlobClientTest, AnswersForANameThatIsNoBlobWithAnError) {
  EXPECT_FALSE(Fetch("../../etc/passwd").ok());
}

TEST_F(BlobClientTest, VanishedOwnersDoNotHoldUpOthers) {
  std::vector<BlobClient::FetchId> stuck;
  for (int i = 0; i < 10; ++i) {
    const std::string id = HashBytes(&i, sizeof(i));
    stuck.push_back(
        reader_.blobs().Fetch(id, "gone-agent", [](const Result<Bytes>&) { ADD_FAILURE(); }));
  }
  const Bytes bytes = RandomBytes(1 << 20, 5);
  const Result<Bytes> fetched = Fetch(owner_.blobs().Offer(bytes));
  EXPECT_TRUE(fetched.ok()) << fetched.error();
  for (const auto id : stuck) reader_.blobs().Cancel(id);
  EXPECT_EQ(reader_.blobs().num_fetching(), 0);
}

TEST_F(BlobClientTest, TellsWhoseOwnerDoesNotAnswer) {
  std::vector<BlobClient::FetchId> gone;
  for (int i = 0; i < 30; ++i) {
    gone.push_back(reader_.blobs().Fetch(HashBytes(&i, sizeof(i)), "gone-agent",
                                         [](const Result<Bytes>&) { ADD_FAILURE(); }));
  }
  const auto num_late = [&] {
    return std::count_if(gone.begin(), gone.end(),
                         [&](auto id) { return reader_.blobs().IsLate(id); });
  };
  ASSERT_TRUE(loop_.RunUntil([&] { return num_late() > 0; }, 10));
  EXPECT_LT(num_late(), 30) << "the others wait for their turn";
  EXPECT_TRUE(loop_.RunUntil([&] { return num_late() == 30; }, 20));
  for (const auto id : gone) reader_.blobs().Cancel(id);
  EXPECT_FALSE(reader_.blobs().IsLate(gone[0]));
}

TEST_F(BlobClientTest, GoesOnWhenTheOwnerComesBack) {
  const Bytes bytes = RandomBytes(2 << 20, 6);
  const std::string id = HashBytes(bytes.data(), bytes.size());
  auto late = std::make_unique<Node>(TestOptions("late"), loop_, bus_);
  late->blobs().Offer(bytes);
  bool done = false;
  reader_.blobs().Fetch(id, "late", [&](const Result<Bytes>& fetched) {
    EXPECT_TRUE(fetched.ok() && *fetched == bytes);
    done = true;
  });
  ASSERT_TRUE(loop_.RunUntil([&] { return reader_.blobs().bytes_pulled() > 200000; }, 20));
  late.reset();
  EXPECT_FALSE(loop_.RunUntil([&] { return done; }, 0.5));
  const int64_t pulled_before = reader_.blobs().bytes_pulled();
  late = std::make_unique<Node>(TestOptions("late"), loop_, bus_);
  late->blobs().Offer(bytes);
  ASSERT_TRUE(loop_.RunUntil([&] { return done; }, 20));
  EXPECT_GT(pulled_before, 200000);
  EXPECT_EQ(reader_.blobs().bytes_pulled(), static_cast<int64_t>(bytes.size()));
}

TEST_F(BlobClientTest, RefusesABlobThatIsTooLarge) {
  const std::string id = owner_.blobs().Offer(RandomBytes(100000, 8));
  std::string error;
  reader_.blobs().Fetch(id, "owner", [&](const Result<Bytes>& fetched) { error = fetched.error(); },
                        {50000});
  ASSERT_TRUE(loop_.RunUntil([&] { return !error.empty(); }, 10));
  EXPECT_NE(error.find("too many"), std::string::npos) << error;
}

TEST_F(BlobClientTest, RefusesBytesThatDoNotMatchTheName) {
  // A liar: answers each request for one blob with zeros.
  const std::string id = HashBytes("truth", 5);
  int num_requests = 0;
  const auto liar = SubscribeToRequests("liar", [&](const blob_request_t& request) {
    ++num_requests;
    blob_chunk_t chunk{};
    chunk.session_id = request.session_id;
    chunk.blob_id = id;
    chunk.total_bytes = 5;
    chunk.size = 5;
    chunk.data.assign(5, 0);
    bus_.PublishBulk(request.reply_channel, chunk);
  });
  std::string error;
  reader_.blobs().Fetch(id, "liar", [&](const Result<Bytes>& fetched) { error = fetched.error(); });
  ASSERT_TRUE(loop_.RunUntil([&] { return !error.empty(); }, 10));
  bus_.Unsubscribe(liar);
  EXPECT_NE(error.find("do not match"), std::string::npos) << error;
  EXPECT_EQ(num_requests, 3);
}

TEST_F(BlobClientTest, ChunksThatLieHoldUpAPullAndEndNone) {
  const Bytes bytes = RandomBytes(1000000, 10);
  const std::string id = owner_.blobs().Offer(bytes);
  int num_lies = 0;
  const auto liar = SubscribeToRequests("owner", [&](const blob_request_t& request) {
    if (++num_lies > 20) return;
    blob_chunk_t chunk{};
    chunk.session_id = request.session_id;
    chunk.blob_id = id;
    chunk.total_bytes = num_lies % 2 == 0 ? BlobClient::kMaxBlobBytes : 2000 + num_lies;
    chunk.offset = num_lies % 3 == 0 ? chunk.total_bytes - 1000 : 0;
    chunk.size = 1000;
    chunk.data.assign(1000, 7);
    bus_.PublishBulk(request.reply_channel, chunk);
  });
  const Result<Bytes> fetched = Fetch(id, 60);
  bus_.Unsubscribe(liar);
  ASSERT_TRUE(fetched.ok()) << fetched.error();
  EXPECT_EQ(*fetched, bytes);
  EXPECT_GT(num_lies, 5);
}

// Two agents with signatures: each answers requests for what it owns, one with bytes that are not
// the blob's.
TEST_F(BlobClientTest, WhatOneOwnerSendsSpoilsNoPullFromAnother) {
  const std::string session = TestOptions("").session_id;
  const SigningKey root = SigningKey::Generate();
  const auto sign_as = [&](Role role, const std::string& name) {
    bus_.SetSeal(std::make_unique<MessageSeal>(SessionTrust{session, root.public_key()},
                                               IssueCredential(root, session, role, name, 0),
                                               SignerCounters(), NowUs),
                 false);
  };
  sign_as(Role::kWorker, "reader");
  const Bytes bytes = RandomBytes(3000000, 12);
  const std::string id = HashBytes(bytes.data(), bytes.size());
  const auto answer = [&](const blob_request_t& request, const std::string& agent) {
    blob_chunk_t chunk{};
    chunk.session_id = session;
    chunk.blob_id = id;
    chunk.total_bytes = static_cast<int64_t>(bytes.size());
    const int64_t end = std::min(chunk.total_bytes, request.offset + request.length);
    sign_as(Role::kAgent, agent);
    for (chunk.offset = request.offset; chunk.offset < end; chunk.offset += chunk.size) {
      chunk.size =
          static_cast<int32_t>(std::min<int64_t>(request.max_chunk_bytes, end - chunk.offset));
      const auto first = bytes.begin() + chunk.offset;
      chunk.data.assign(first, first + chunk.size);
      if (agent == "mallory") chunk.data.assign(chunk.size, 7);
      bus_.PublishBulk(request.reply_channel, chunk);
    }
    sign_as(Role::kWorker, "reader");
  };
  std::vector<Bus::SubscriptionId> agents;
  for (const std::string agent : {"mallory", "alice"}) {
    agents.push_back(SubscribeToRequests(
        AgentInstance(agent),
        [&answer, agent](const blob_request_t& request) { answer(request, agent); }));
  }
  bool done = false;
  const auto fetch = [&](const std::string& agent) {
    const auto on_fetched = [&, agent](const Result<Bytes>& fetched) {
      if (agent != "alice") return;
      EXPECT_TRUE(fetched.ok() && *fetched == bytes) << fetched.error();
      done = true;
    };
    reader_.blobs().Fetch(id, AgentInstance(agent), on_fetched,
                          {BlobClient::kMaxBlobBytes, static_cast<int64_t>(bytes.size())});
  };
  fetch("mallory");
  fetch("alice");
  EXPECT_TRUE(loop_.RunUntil([&] { return done; }, 20));
  for (const Bus::SubscriptionId agent : agents) bus_.Unsubscribe(agent);
}

// Sixteen blobs of one owner, whose names come first and each of whose chunks comes after 0.3 s.
TEST_F(BlobClientTest, AnOwnerThatAnswersSlowlyHoldsUpOnlyItself) {
  constexpr int64_t kSlowBytes = 64 << 20;
  std::vector<std::pair<double, blob_request_t>> waiting;  // when it is answered
  const auto requests = SubscribeToRequests("slow", [&](const blob_request_t& request) {
    waiting.emplace_back(loop_.now_s() + 0.3, request);
  });
  const auto timer = loop_.AddTimer(0.01, [&] {
    while (!waiting.empty() && waiting.front().first <= loop_.now_s()) {
      const blob_request_t request = waiting.front().second;
      waiting.erase(waiting.begin());
      blob_chunk_t chunk{};
      chunk.session_id = request.session_id;
      chunk.blob_id = request.blob_id;
      chunk.total_bytes = kSlowBytes;
      chunk.size = request.max_chunk_bytes;
      chunk.data.assign(chunk.size, 7);
      for (int64_t at = 0; at < request.length; at += chunk.size) {
        chunk.offset = request.offset + at;
        bus_.PublishBulk(request.reply_channel, chunk);
      }
    }
  });
  std::vector<BlobClient::FetchId> slow;
  for (int i = 0; i < 16; ++i) {
    std::string id(64, '0');
    id.back() = "0123456789abcdef"[i];
    slow.push_back(reader_.blobs().Fetch(id, "slow", [](const Result<Bytes>&) { ADD_FAILURE(); }));
  }
  ASSERT_TRUE(loop_.RunUntil([&] { return reader_.blobs().bytes_pulled() > (8 << 20); }, 20));
  for (uint64_t i = 0; i < 10; ++i) {
    const Result<Bytes> fetched = Fetch(owner_.blobs().Offer(RandomBytes(1 << 20, 40 + i)), 5);
    EXPECT_TRUE(fetched.ok()) << i << ": " << fetched.error();
  }
  bus_.Unsubscribe(requests);
  loop_.CancelTimer(timer);
  for (const auto id : slow) reader_.blobs().Cancel(id);
}

TEST_F(BlobClientTest, MorePartiesThanChunksInFlightHaveEachItsTurn) {
  int num_done = 0;
  for (uint64_t i = 0; i < 100; ++i) {
    BlobClient::FetchOptions options;
    options.party = "party " + std::to_string(i);
    reader_.blobs().Fetch(
        owner_.blobs().Offer(RandomBytes(100000, 100 + i)), "owner",
        [&](const Result<Bytes>& fetched) { num_done += fetched.ok() ? 1 : 0; }, options);
  }
  EXPECT_TRUE(loop_.RunUntil([&] { return num_done == 100; }, 20));
}

TEST_F(BlobClientTest, FetchesThatTellDifferentSizesOfABlobBothEndWithIt) {
  const Bytes bytes = RandomBytes(100000, 11);
  const std::string id = owner_.blobs().Offer(bytes);
  int num_done = 0;
  const auto on_fetched = [&](const Result<Bytes>& fetched) {
    EXPECT_TRUE(fetched.ok() && *fetched == bytes) << fetched.error();
    ++num_done;
  };
  reader_.blobs().Fetch(id, "owner", on_fetched, {200000, 150000});
  EXPECT_FALSE(loop_.RunUntil([&] { return num_done > 0; }, 1));
  reader_.blobs().Fetch(id, "owner", on_fetched, {100000, 100000});
  EXPECT_TRUE(loop_.RunUntil([&] { return num_done == 2; }, 20));
}

TEST_F(BlobClientTest, ManyVanishedOwnersDoNotHoldUpOneThatAnswers) {
  std::vector<BlobClient::FetchId> stuck;
  for (int i = 0; i < 64; ++i) {
    stuck.push_back(reader_.blobs().Fetch(HashBytes(&i, sizeof(i)), "gone-" + std::to_string(i),
                                          [](const Result<Bytes>&) { ADD_FAILURE(); }));
  }
  for (uint64_t i = 0; i < 5; ++i) {
    const Result<Bytes> fetched = Fetch(owner_.blobs().Offer(RandomBytes(1 << 20, 20 + i)), 8);
    EXPECT_TRUE(fetched.ok()) << i << ": " << fetched.error();
  }
  for (const auto id : stuck) reader_.blobs().Cancel(id);
}

TEST_F(BlobClientTest, ServesOutOfTheSessionFolderAndReadsItDirectly) {
  char name[] = "/tmp/skein_blob_test_XXXXXX";
  const std::string folder = ::mkdtemp(name);
  NodeOptions local_options = TestOptions("local");
  local_options.session_id.clear();
  local_options.session_dir = folder;
  {
    Node local(local_options, loop_, bus_);
    bus_.SetSession("");
    const Bytes bytes = RandomBytes(300000, 9);
    const std::string id = local.blobs().Offer(bytes);
    bool done = false;
    local.blobs().Fetch(id, "nobody", [&](const Result<Bytes>& fetched) {
      EXPECT_TRUE(fetched.ok() && *fetched == bytes);
      done = true;
    });
    ASSERT_TRUE(loop_.RunUntil([&] { return done; }, 10));
    EXPECT_EQ(local.blobs().bytes_pulled(), 0);

    done = false;
    reader_.blobs().Fetch(id, "local", [&](const Result<Bytes>& fetched) {
      EXPECT_TRUE(fetched.ok() && *fetched == bytes);
      done = true;
    });
    ASSERT_TRUE(loop_.RunUntil([&] { return done; }, 10));
    EXPECT_EQ(reader_.blobs().bytes_pulled(), 300000);
  }
  std::filesystem::remove_all(folder);
}

TEST(BlobShelf, ForgetsWhatNobodyAskedForInItsTime) {
  double now_s = 0;
  BlobShelf shelf(100, [&] { return now_s; });
  shelf.HoldFor("a", std::make_shared<const Bytes>(10), 60);
  now_s = 50;
  EXPECT_NE(shelf.Find("a"), nullptr);  // which is a use
  now_s = 109;
  shelf.DropExpired();
  EXPECT_EQ(shelf.num_held(), 1u);
  now_s = 110;
  shelf.DropExpired();
  EXPECT_EQ(shelf.num_held(), 0u);
}

TEST(BlobShelf, ServesNoMoreThanItsBound) {
  double now_s = 0;
  BlobShelf shelf(100, [&] { return now_s; });
  const auto blob = std::make_shared<const Bytes>(BlobShelf::kMaxServedBytes / 4);
  shelf.Hold("held", blob);
  for (const std::string id : {"a", "b", "c", "d"}) {
    ++now_s;
    shelf.HoldFor(id, blob, 60);
  }
  ++now_s;
  EXPECT_NE(shelf.Find("a"), nullptr);
  shelf.HoldFor("e", blob, 60);
  EXPECT_EQ(shelf.Find("b"), nullptr) << "nobody asked for it for longest";
  for (const std::string id : {"held", "a", "c", "d", "e"})
    EXPECT_NE(shelf.Find(id), nullptr) << id;
}

TEST(BlobShelf, ForgetsTheOldestBeyondItsBytesButNotWhatIsHeld) {
  BlobShelf shelf(100);
  const auto blob = std::make_shared<const Bytes>(40, 0);
  shelf.Cache("a", blob);
  shelf.Cache("b", blob);
  EXPECT_TRUE(shelf.Find("a"));
  shelf.Cache("c", blob);
  EXPECT_TRUE(shelf.Find("a"));
  EXPECT_FALSE(shelf.Find("b"));
  EXPECT_EQ(shelf.cached_bytes(), 80u);
  shelf.Cache("huge", std::make_shared<const Bytes>(101, 0));
  EXPECT_FALSE(shelf.Find("huge"));

  shelf.Hold("h", blob);
  shelf.Hold("h", blob);
  shelf.Release("h");
  EXPECT_TRUE(shelf.Find("h"));
  shelf.Release("h");
  EXPECT_FALSE(shelf.Find("h"));
}

TEST(BlobPull, UsesTheSmallerChunksOfItsSender) {
  const Bytes blob = RandomBytes(5000, 1);
  PullWindow window(8, 64);
  RoundTrip round_trip;
  BlobPull pull(2000, 1 << 20);
  BlobPull::Outcome outcome = BlobPull::Outcome::kIgnored;
  for (int round = 0; round < 10 && outcome != BlobPull::Outcome::kComplete; ++round) {
    const auto ask = pull.NextAsk(8, round, &window);
    if (!ask) {
      pull.CheckTimeout(round + 1e3, round_trip, &window);
      continue;
    }
    const int64_t end = std::min<int64_t>(5000, ask->offset + ask->length);
    for (int64_t at = ask->offset; at < end; at += 600) {
      outcome = pull.OnChunk(at, 5000, blob.data() + at, std::min<int64_t>(600, end - at), round,
                             &window, &round_trip);
    }
  }
  ASSERT_EQ(outcome, BlobPull::Outcome::kComplete);
  EXPECT_EQ(pull.Take(), blob);
}

TEST(BlobPull, IgnoresChunksThatDoNotFit) {
  PullWindow window(8, 64);
  RoundTrip round_trip;
  BlobPull pull(1000, 1 << 20);
  pull.NextAsk(8, 0, &window);
  const Bytes data(1000, 1);
  const auto chunk = [&](int64_t offset, int64_t total, size_t size) {
    return pull.OnChunk(offset, total, data.data(), size, 0, &window, &round_trip);
  };
  EXPECT_EQ(chunk(0, 3500, 1000), BlobPull::Outcome::kTaken);
  EXPECT_EQ(chunk(0, 3500, 1000), BlobPull::Outcome::kIgnored);
  EXPECT_EQ(chunk(1, 3500, 1000), BlobPull::Outcome::kIgnored);
  EXPECT_EQ(chunk(-1000, 3500, 1000), BlobPull::Outcome::kIgnored);
  EXPECT_EQ(chunk(1000, 3500, 999), BlobPull::Outcome::kIgnored);
  EXPECT_EQ(chunk(1000, 9999, 1000), BlobPull::Outcome::kIgnored);
  EXPECT_EQ(chunk(4000, 3500, 1000), BlobPull::Outcome::kIgnored);
  EXPECT_EQ(chunk(1000, int64_t{1} << 40, 1000), BlobPull::Outcome::kIgnored);
  EXPECT_EQ(chunk(3000, 3500, 500), BlobPull::Outcome::kTaken);
}

TEST(BlobPull, BelievesOnlyManyChunksThatTheBlobIsTooLarge) {
  PullWindow window(8, 64);
  RoundTrip round_trip;
  BlobPull pull(1000, 1 << 20);
  pull.NextAsk(8, 0, &window);
  const Bytes data(1000, 1);
  BlobPull::Outcome outcome = BlobPull::Outcome::kIgnored;
  int num_told = 0;
  for (; outcome == BlobPull::Outcome::kIgnored && num_told < 100; ++num_told) {
    outcome = pull.OnChunk(0, 1 << 21, data.data(), data.size(), 0, &window, &round_trip);
  }
  EXPECT_EQ(outcome, BlobPull::Outcome::kTooLarge);
  EXPECT_GT(num_told, 5);
}

TEST(BlobPull, TakesNothingThatWasNotAskedFor) {
  PullWindow window(8, 64);
  RoundTrip round_trip;
  const int64_t total = 1 << 30;
  BlobPull pull(1024, total);
  pull.NextAsk(8, 0, &window);
  const Bytes data(1024, 1);
  EXPECT_EQ(pull.OnChunk(total - 1024, total, data.data(), 1024, 0, &window, &round_trip),
            BlobPull::Outcome::kIgnored)
      << "it would take the memory of all before it";
  EXPECT_EQ(pull.OnChunk(0, total, data.data(), 1024, 0, &window, &round_trip),
            BlobPull::Outcome::kTaken);
  EXPECT_EQ(pull.received_bytes(), 1024);
}

TEST(BlobPull, BeginsAnewWhenOnlyChunksOfAnotherSizeCome) {
  PullWindow window(8, 64);
  RoundTrip round_trip;
  BlobPull pull(1000, 1 << 20);
  pull.NextAsk(8, 0, &window);
  const Bytes lie(1000, 6), truth(1000, 1);
  EXPECT_EQ(pull.OnChunk(0, 9000, lie.data(), 1000, 0, &window, &round_trip),
            BlobPull::Outcome::kTaken);
  EXPECT_EQ(pull.OnChunk(0, 1000, truth.data(), 1000, 0, &window, &round_trip),
            BlobPull::Outcome::kIgnored);
  ASSERT_TRUE(pull.CheckTimeout(10, round_trip, &window));
  ASSERT_TRUE(pull.NextAsk(8, 10, &window));
  EXPECT_EQ(pull.OnChunk(0, 1000, truth.data(), 1000, 10, &window, &round_trip),
            BlobPull::Outcome::kComplete);
  EXPECT_EQ(pull.Take(), truth);
}

TEST(BlobPull, GoesByTheSizeItIsTold) {
  PullWindow window(8, 64);
  RoundTrip round_trip;
  BlobPull pull(1000, 1 << 20, 1000);
  pull.NextAsk(8, 0, &window);
  const Bytes data(1000, 1);
  for (const int64_t lie : {int64_t{5000}, int64_t{-1}, int64_t{1} << 40}) {
    EXPECT_EQ(pull.OnChunk(0, lie, data.data(), 1000, 0, &window, &round_trip),
              BlobPull::Outcome::kIgnored);
  }
  EXPECT_EQ(pull.OnChunk(0, 1000, data.data(), 1000, 0, &window, &round_trip),
            BlobPull::Outcome::kComplete);
}

TEST(PullWindow, HalvesOnceARoundTrip) {
  PullWindow window(16, 64);
  int64_t first = window.NextTicket();
  for (int i = 0; i < 10; ++i) window.NextTicket();
  window.OnLoss(first);
  EXPECT_EQ(window.size(), 8);
  window.OnLoss(first + 1);
  EXPECT_EQ(window.size(), 8);
  window.OnLoss(window.NextTicket());
  EXPECT_EQ(window.size(), 4);
  for (int i = 0; i < 100000; ++i) window.OnArrival();
  EXPECT_EQ(window.size(), 64);
}

}  // namespace skein::blob_client_test
