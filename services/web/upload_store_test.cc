#include "web/upload_store.h"

#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "core/file.h"
#include "core/folder.h"
#include "core/hash.h"
#include "http/job_pool.h"
#include "testing/test_folder.h"
#include "web/upload_sink.h"

namespace skein::upload_store_test {

// A disk that does not answer: writes to a file that is held wait until it is released, and fail.
class HangingFiles {
 public:
  void Hold(const std::filesystem::path& file) {
    const std::lock_guard<std::mutex> lock(mutex_);
    held_.insert(file.string());
  }
  void Release(const std::filesystem::path& file) {
    const std::lock_guard<std::mutex> lock(mutex_);
    held_.erase(file.string());
    released_.notify_all();
  }
  // False: the file was not held.
  bool Wait(const std::string& file) {
    std::unique_lock<std::mutex> lock(mutex_);
    if (held_.count(file) == 0) return false;
    released_.wait(lock, [&] { return held_.count(file) == 0; });
    return true;
  }

 private:
  std::mutex mutex_;
  std::condition_variable released_;
  std::set<std::string> held_;
};

HangingFiles& HangingDisk() {
  static HangingFiles files;
  return files;
}

}  // namespace skein::upload_store_test

// In place of the C library's.
extern "C" ssize_t pwrite(int fd, const void* data, size_t size, off_t offset) {
  const auto file = std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(fd));
  if (!skein::upload_store_test::HangingDisk().Wait(file))
    return ::syscall(SYS_pwrite64, fd, data, size, offset);
  errno = EIO;
  return -1;
}

namespace skein::upload_store_test {

class UploadStoreTest : public testing::Test {
 protected:
  using Job = std::function<void()>;

  UploadStoreTest() { Open(); }

  static Bytes BytesOf(const std::string& text) { return Bytes(text.begin(), text.end()); }
  static std::string IdOf(const std::string& text) { return HashBytes(text.data(), text.size()); }
  static UploadInfo InfoOf(const std::string& text, const std::string& name = "a.jpg") {
    UploadInfo info;
    info.name = name;
    info.size_bytes = static_cast<int64_t>(text.size());
    return info;
  }

  void Open() {
    store_.reset();
    store_ = std::make_unique<UploadStore>(
        dir_, limits_, [this](Job job) { run_job_(std::move(job)); }, [this] { return now_s_; });
  }
  // Sends `text` from the offset on.
  Status Send(const std::string& agent, const std::string& whole, int64_t offset,
              const std::string& text) {
    const auto receiver = store_->Begin(agent, IdOf(whole), InfoOf(whole), offset);
    if (!receiver.ok()) return receiver.status();
    const auto taken = store_->Take(*receiver, BytesOf(text));
    if (!taken.ok()) return taken.status();
    if (taken->received_bytes == taken->size_bytes) return store_->Finish(*receiver);
    store_->Leave(*receiver);
    return Status::Ok();
  }
  size_t NumFiles() const { return FilesUnder(dir_).size(); }
  // What writes to the photo's bytes waits from now on, until Release.
  std::filesystem::path HoldUp(const std::string& agent, const std::string& whole) const {
    const std::filesystem::path part = dir_ / agent / (IdOf(whole) + ".part");
    HangingDisk().Hold(part);
    return part;
  }
  static void Release(const std::filesystem::path& part) { HangingDisk().Release(part); }

  TestFolder folder_;
  const std::filesystem::path dir_ = folder_ / "uploads";
  double now_s_ = 100;
  UploadLimits limits_;
  UploadStore::RunJob run_job_ = [](const Job& job) { job(); };
  std::unique_ptr<UploadStore> store_;
};

TEST_F(UploadStoreTest, GoesOnWhereItStopped) {
  const std::string photo = "0123456789";
  EXPECT_FALSE(store_->Look("anna", IdOf(photo)));
  EXPECT_TRUE(Send("anna", photo, 0, "0123").ok());
  EXPECT_EQ(store_->Look("anna", IdOf(photo))->received_bytes, 4);
  EXPECT_FALSE(store_->Look("bert", IdOf(photo))) << "another's";
  EXPECT_EQ(Send("anna", photo, 0, "0123").code, StatusCode::kAlreadyExists);
  EXPECT_EQ(Send("anna", photo, 5, "56789").code, StatusCode::kAlreadyExists);
  Open();
  EXPECT_EQ(store_->Look("anna", IdOf(photo))->received_bytes, 4) << "after a restart";
  EXPECT_TRUE(store_->Waiting().empty());
  EXPECT_TRUE(Send("anna", photo, 4, "456789").ok());
  EXPECT_TRUE(store_->Look("anna", IdOf(photo))->is_stored);
  ASSERT_EQ(store_->Waiting().size(), 1u);
  EXPECT_EQ(*ReadFile(store_->Waiting()[0].path.string()), BytesOf(photo));
}

TEST_F(UploadStoreTest, KeepsWholePhotosOverARestartUntilTheyAreRemoved) {
  ASSERT_TRUE(Send("anna", "first", 0, "first").ok());
  ASSERT_TRUE(Send("anna", "second", 0, "second").ok());
  Open();
  ASSERT_EQ(store_->Waiting().size(), 2u);
  EXPECT_EQ(store_->Waiting()[0].info.name, "a.jpg");
  EXPECT_EQ(Send("anna", "first", 0, "first").code, StatusCode::kAlreadyExists);
  store_->Remove("anna", IdOf("first"));
  store_->Remove("anna", IdOf("second"));
  EXPECT_EQ(NumFiles(), 0u);
  EXPECT_FALSE(store_->Look("anna", IdOf("first")));
}

TEST_F(UploadStoreTest, RefusesBytesOfAnotherHash) {
  const auto receiver = store_->Begin("anna", IdOf("abc"), InfoOf("abc"), 0);
  ASSERT_TRUE(receiver.ok());
  ASSERT_TRUE(store_->Take(*receiver, BytesOf("abd")).ok());
  EXPECT_EQ(store_->Finish(*receiver).code, StatusCode::kDataLoss);
  EXPECT_FALSE(store_->Look("anna", IdOf("abc")));
  EXPECT_EQ(NumFiles(), 0u);
}

TEST_F(UploadStoreTest, RefusesWhatNeverWillBeTaken) {
  const std::string id = IdOf("abc");
  EXPECT_EQ(store_->Begin("../anna", id, InfoOf("abc"), 0).code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(store_->Begin("anna", "../x", InfoOf("abc"), 0).code(), StatusCode::kInvalidArgument);
  for (const char* name : {"", "../a.jpg", "/a.jpg", "a/../../b.jpg", "a\n.jpg", "\xff.jpg"}) {
    EXPECT_EQ(store_->Begin("anna", id, InfoOf("abc", name), 0).code(),
              StatusCode::kInvalidArgument)
        << name;
  }
  UploadInfo large = InfoOf("abc");
  large.size_bytes = limits_.max_photo_bytes + 1;
  EXPECT_EQ(store_->Begin("anna", id, large, 0).code(), StatusCode::kResourceExhausted);
  large.size_bytes = 0;
  EXPECT_FALSE(store_->Begin("anna", id, large, 0).ok());
  EXPECT_EQ(NumFiles(), 0u);
}

TEST_F(UploadStoreTest, TakesNoMoreBytesThanWereTold) {
  const auto receiver = store_->Begin("anna", IdOf("abc"), InfoOf("abc"), 0);
  EXPECT_TRUE(store_->Take(*receiver, BytesOf("ab")).ok());
  EXPECT_EQ(store_->Take(*receiver, BytesOf("cd")).code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(store_->Begin("anna", IdOf("abc"), InfoOf("abcd"), 2).code(),
            StatusCode::kInvalidArgument)
      << "another size";
}

TEST_F(UploadStoreTest, TheLatestConnectionOfAPhotoCounts) {
  const auto first = store_->Begin("anna", IdOf("abcd"), InfoOf("abcd"), 0);
  ASSERT_TRUE(store_->Take(*first, BytesOf("a")).ok());
  const auto second = store_->Begin("anna", IdOf("abcd"), InfoOf("abcd"), 1);
  ASSERT_TRUE(second.ok()) << second.error();
  EXPECT_FALSE(store_->Take(*first, BytesOf("b")).ok()) << "it was lost, and does not know it";
  store_->Leave(*first);
  EXPECT_TRUE(store_->Take(*second, BytesOf("b")).ok());
  EXPECT_EQ(store_->Look("anna", IdOf("abcd"))->received_bytes, 2);
  EXPECT_FALSE(store_->Take(*second, BytesOf("c")).ok()) << "what was told stays true";
}

TEST_F(UploadStoreTest, APositionHasTwoNumbersAndAnAltitudeWhereItIsKnown) {
  JobPool pool(1, 1);
  const auto is_taken = [&](const std::string& gps) {
    HttpRequest request;
    request.visitor.name = "anna";
    request.body_bytes = 3;
    request.fields = {{"upload-offset", "0"}, {"upload-length", "3"}, {"upload-name", "a.jpg"}};
    request.fields["upload-gps"] = gps;
    std::promise<int> status;
    const auto sink = MakeUploadSink(*store_, pool, request, IdOf(gps));
    sink->Begin([&status](std::optional<HttpResponse> answer) {
      status.set_value(answer.value_or(HttpError(0, "")).status);
    });
    const int said = status.get_future().get();
    store_->Remove("anna", IdOf(gps));
    return said == 0;
  };
  EXPECT_TRUE(is_taken("47.5,8.2,430"));
  EXPECT_TRUE(is_taken("47.5,8.2,"));
  for (const char* gps :
       {"1,2", "1,,3", "1,2,3,", "1,2,3,4", "1 2 3", "nan,2,3", "1,2,inf", "", ",,", "91,2,3"}) {
    EXPECT_FALSE(is_taken(gps)) << gps;
  }
}

// Two threads write; each of anna's photos has one, for good.
TEST_F(UploadStoreTest, WritesThatHangHoldUpNoOtherAgent) {
  JobPool pool(2, 8, 0.02);
  const auto sink_of = [&](const std::string& agent, const std::string& photo) {
    HttpRequest request;
    request.visitor.name = agent;
    request.body_bytes = photo.size();
    request.fields = {{"upload-offset", "0"},
                      {"upload-length", std::to_string(photo.size())},
                      {"upload-name", "a.jpg"}};
    return MakeUploadSink(*store_, pool, request, IdOf(photo));
  };
  // The answer; of none, status 0.
  const auto answer = [](const std::function<void(BodySink::Next)>& ask) {
    std::promise<HttpResponse> said;
    ask([&said](std::optional<HttpResponse> response) {
      said.set_value(response.value_or(HttpError(0, "")));
    });
    auto future = said.get_future();
    if (future.wait_for(std::chrono::seconds(20)) != std::future_status::ready) std::abort();
    return future.get().status;
  };
  const std::vector<std::string> photos = {"one", "two", "three", "four"};
  std::vector<std::shared_ptr<BodySink>> held;
  std::vector<std::filesystem::path> parts;
  std::vector<std::promise<void>> ended(photos.size());
  for (size_t i = 0; i < photos.size(); ++i) {
    held.push_back(sink_of("anna", photos[i]));
    ASSERT_EQ(answer([&](BodySink::Next next) { held[i]->Begin(next); }), 0);
    parts.push_back(HoldUp("anna", photos[i]));
    held[i]->Take(BytesOf(photos[i]), [&, i](auto) { ended[i].set_value(); });
  }
  const auto bert = sink_of("bert", "whole");
  EXPECT_EQ(answer([&](BodySink::Next next) { bert->Begin(next); }), 0);
  EXPECT_EQ(answer([&](BodySink::Next next) { bert->Take(BytesOf("whole"), next); }), 0);
  EXPECT_EQ(answer([&](BodySink::Next next) { bert->End(next); }), 201);
  // More of hers would be held up, too, whatever becomes of the connections.
  held.clear();
  for (const std::string& photo : photos) store_->Look("anna", IdOf(photo));
  EXPECT_EQ(Send("anna", "five", 0, "five").code, StatusCode::kUnavailable);
  for (const auto& part : parts) Release(part);
  for (auto& one : ended) one.get_future().wait();
}

TEST_F(UploadStoreTest, AWriteHoldsUpNoOtherPhoto) {
  const auto held = store_->Begin("anna", IdOf("abcd"), InfoOf("abcd"), 0);
  ASSERT_TRUE(held.ok());
  const std::filesystem::path part = HoldUp("anna", "abcd");
  auto writing = std::async(std::launch::async,
                            [&] { return store_->Take(*held, BytesOf("ab")).status().code; });
  const auto is_at_it = [&] {  // else the offset is wrong
    const auto again = store_->Begin("anna", IdOf("abcd"), InfoOf("abcd"), 1);
    return again.code() == StatusCode::kUnavailable;
  };
  auto others = std::async(std::launch::async, [&] {
    while (!is_at_it()) std::this_thread::yield();
    EXPECT_EQ(store_->Look("anna", IdOf("abcd"))->received_bytes, 0) << "they do not count yet";
    for (int i = 0; i <= UploadStore::kMaxUnfinished; ++i) {
      EXPECT_TRUE(Send("anna", "photo " + std::to_string(i), 0, "p").ok())
          << "the one that is written stays";
    }
    EXPECT_TRUE(Send("bert", "whole", 0, "whole").ok());
    store_->Remove("bert", IdOf("whole"));
    store_->Tick();
    EXPECT_TRUE(is_at_it());
  });
  const bool went_on = others.wait_for(std::chrono::seconds(20)) == std::future_status::ready;
  EXPECT_TRUE(went_on);
  Release(part);
  others.get();
  EXPECT_EQ(writing.get(), StatusCode::kUnavailable);
  EXPECT_EQ(store_->ProgressOf("anna").size(), size_t{UploadStore::kMaxUnfinished});
  EXPECT_TRUE(store_->Begin("anna", IdOf("abcd"), InfoOf("abcd"), 0).ok());
}

TEST_F(UploadStoreTest, JobsDeleteOfAnAgentOneAtATime) {
  std::vector<Job> jobs;
  run_job_ = [&jobs](Job job) { jobs.push_back(std::move(job)); };
  for (const std::string photo : {"one", "two"}) {
    ASSERT_TRUE(Send("anna", photo, 0, photo).ok());
    store_->Remove("anna", IdOf(photo));
    store_->Tick();
  }
  ASSERT_TRUE(Send("bert", "one", 0, "one").ok()) << "another's";
  store_->Remove("bert", IdOf("one"));
  EXPECT_TRUE(store_->Waiting().empty());
  EXPECT_EQ(NumFiles(), 6u);
  EXPECT_EQ(Send("anna", "one", 0, "one").code, StatusCode::kUnavailable) << "it still goes";
  ASSERT_EQ(jobs.size(), 2u);
  jobs[0]();
  EXPECT_EQ(NumFiles(), 2u) << "bert's";
  EXPECT_TRUE(Send("anna", "one", 0, "one").ok());
  EXPECT_EQ(Send("bert", "one", 0, "one").code, StatusCode::kUnavailable);
  jobs[1]();
  store_->Remove("anna", IdOf("one"));
  ASSERT_EQ(jobs.size(), 3u);
  jobs[2]();
  EXPECT_EQ(NumFiles(), 0u);
}

TEST_F(UploadStoreTest, WhatIsOfAnotherHashIsGoneOnceThatIsTold) {
  run_job_ = [](const Job&) { FAIL(); };
  const auto receiver = store_->Begin("anna", IdOf("abc"), InfoOf("abc"), 0);
  ASSERT_TRUE(store_->Take(*receiver, BytesOf("abd")).ok());
  EXPECT_EQ(store_->Finish(*receiver).code, StatusCode::kDataLoss);
  EXPECT_TRUE(Send("anna", "abc", 0, "abc").ok()) << "it is sent anew";
}

TEST_F(UploadStoreTest, IsBoundedForEachAgent) {
  constexpr int kMost = UploadStore::kMaxUnfinished, kAtATime = UploadStore::kMaxReceiving;
  std::vector<UploadStore::Receiver> receivers;
  const auto photo_of = [](int i) { return "photo " + std::to_string(i); };
  for (int i = 0; i < kAtATime; ++i) {
    const std::string photo = photo_of(i);
    receivers.push_back(*store_->Begin("anna", IdOf(photo), InfoOf(photo), 0));
  }
  EXPECT_EQ(store_->Begin("anna", IdOf("x"), InfoOf("x"), 0).code(), StatusCode::kUnavailable);
  EXPECT_TRUE(store_->Begin("bert", IdOf("x"), InfoOf("x"), 0).ok()) << "others go on";
  for (const auto& receiver : receivers) store_->Leave(receiver);
  for (int i = kAtATime; i <= kMost; ++i) {
    now_s_ += 1;
    EXPECT_TRUE(Send("anna", photo_of(i), 0, "p").ok());
  }
  EXPECT_EQ(store_->ProgressOf("anna").size(), size_t{kMost}) << "one that rested longest went";
  EXPECT_TRUE(store_->Look("anna", IdOf(photo_of(kMost))));
}

TEST_F(UploadStoreTest, IsBoundedInAllAndForgetsWhatRests) {
  limits_.max_bytes = 10;
  Open();
  ASSERT_TRUE(Send("anna", "12345678", 0, "1234").ok());
  EXPECT_EQ(Send("anna", "abc", 0, "abc").code, StatusCode::kUnavailable) << "told bytes count";
  now_s_ += UploadStore::kForgetAfterS + 1;
  store_->Tick();
  EXPECT_FALSE(store_->Look("anna", IdOf("12345678")));
  EXPECT_TRUE(Send("anna", "abc", 0, "abc").ok());
  now_s_ += UploadStore::kForgetAfterS + 1;
  store_->Tick();
  EXPECT_EQ(store_->Waiting().size(), 1u) << "what was received stays";
}

TEST_F(UploadStoreTest, WhatIsBegunAndLeftKeepsNobodyOut) {
  limits_.max_bytes = 80;
  Open();
  const std::string rest(19, '.');
  for (const std::string photo : {"1", "2"}) {
    for (const char* agent : {"mia", "max"}) {
      now_s_ += 1;
      ASSERT_TRUE(Send(agent, photo + rest, 0, photo).ok());
    }
  }
  now_s_ += 1;
  const std::string small = "three";
  ASSERT_TRUE(Send("anna", small, 0, small).ok()) << "80 of 80 bytes were told";
  EXPECT_FALSE(store_->Look("mia", IdOf("1" + rest))) << "it was silent for longest";
  EXPECT_TRUE(store_->Look("max", IdOf("1" + rest)));
  EXPECT_EQ(store_->Waiting().size(), 1u);
  EXPECT_EQ(Send("max", "5" + rest, 0, "5").code, StatusCode::kUnavailable)
      << "it is beyond its share";
  EXPECT_EQ(store_->Waiting().size(), 1u);
  EXPECT_TRUE(Send("mia", "1" + rest.substr(8), 0, "1").ok())
      << "there is room, and nobody wants it";
}

TEST_F(UploadStoreTest, AConnectionThatCrawlsMakesWay) {
  limits_.max_bytes = 20;
  Open();
  const auto crawling =
      store_->Begin("mia", IdOf("0123456789abcdef"), InfoOf("0123456789abcdef"), 0);
  ASSERT_TRUE(crawling.ok());
  ASSERT_TRUE(store_->Take(*crawling, BytesOf("0")).ok());
  EXPECT_TRUE(Send("anna", "01234567", 0, "01234567").ok());
  EXPECT_EQ(store_->Take(*crawling, BytesOf("1")).code(), StatusCode::kUnavailable);
  EXPECT_EQ(store_->Finish(*crawling).code, StatusCode::kUnavailable);
  store_->Leave(*crawling);
  EXPECT_FALSE(store_->Look("mia", IdOf("0123456789abcdef"))) << "its phone begins anew";
}

TEST_F(UploadStoreTest, WhoHasItsShareLeavesRoomToWhoWantsSome) {
  limits_.max_bytes = 20;
  Open();
  ASSERT_TRUE(Send("mia", "0123456789", 0, "0123456789").ok());
  ASSERT_TRUE(Send("mia", "abcdefghij", 0, "abcdefghij").ok());
  EXPECT_EQ(Send("anna", "three", 0, "three").code, StatusCode::kUnavailable)
      << "what was received stays";
  store_->Remove("mia", IdOf("abcdefghij"));
  EXPECT_EQ(Send("mia", "more", 0, "more").code, StatusCode::kUnavailable) << "anna wants room";
  EXPECT_TRUE(Send("anna", "three", 0, "three").ok());
  EXPECT_TRUE(Send("mia", "more", 0, "more").ok()) << "nobody wants any";
  now_s_ += 1;
  EXPECT_EQ(Send("anna", "fours", 0, "f").code, StatusCode::kUnavailable);
  now_s_ += UploadStore::kWantS + 1;
  store_->Remove("mia", IdOf("more"));
  EXPECT_TRUE(Send("mia", "more", 0, "more").ok()) << "anna has gone";
}

TEST_F(UploadStoreTest, WaitsWhileTheDiskIsFull) {
  limits_.min_free_bytes = int64_t{1} << 60;
  Open();
  const Status status = Send("anna", "abc", 0, "abc");
  EXPECT_EQ(status.code, StatusCode::kUnavailable);
  EXPECT_NE(status.error().find("disk is full"), std::string::npos);
}

TEST_F(UploadStoreTest, ClearsAwayWhatACrashLeft) {
  ASSERT_TRUE(Send("anna", "whole", 0, "whole").ok());
  ASSERT_TRUE(Send("anna", "0123", 0, "01").ok());
  const std::string lonely = IdOf("lonely");
  for (const std::string& name : {"anna/" + lonely + ".part", std::string("anna/readme"),
                                  std::string("stray"), "anna/" + lonely + "x.json"}) {
    std::ofstream(dir_ / name) << "x";
  }
  std::ofstream(dir_ / "anna" / (IdOf("damaged") + ".json")) << "{\"name\":";
  std::ofstream(dir_ / "anna" / (IdOf("none") + ".json"))
      << "{\"name\":\"a.jpg\",\"bytes\":-1,\"taken\":0}";
  std::ofstream(dir_ / "anna" / (IdOf("0123") + ".part")) << "more bytes than it has";
  Open();
  EXPECT_EQ(store_->Waiting().size(), 1u);
  EXPECT_FALSE(store_->Look("anna", IdOf("0123")));
  EXPECT_EQ(NumFiles(), 2u) << "the whole photo and what is known of it";
}

}  // namespace skein::upload_store_test
