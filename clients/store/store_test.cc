// A session folder with everything that can be damaged, and what check, repair and clone make of
// it. The photos are not photos: nothing here looks into them.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <random>

#include "auth/relay_certificate.h"
#include "auth/revocations.h"
#include "auth/session_keys.h"
#include "blobs/blob_store.h"
#include "clients/store/session_check.h"
#include "clients/store/session_clone.h"
#include "clients/store/session_repair.h"
#include "clients/store/session_writer.h"
#include "core/checksum_list.h"
#include "core/file.h"
#include "core/folder.h"
#include "core/hash.h"
#include "ledger/fact_ids.h"
#include "ledger/photo_file.h"
#include "testing/test_folder.h"

namespace skein::store_test {

namespace fs = std::filesystem;

using Remedy = Finding::Remedy;

constexpr char kId[] = "0123456789abcdef";
constexpr int kNumPhotos = 6;

Bytes Content(const std::string& what) {
  Bytes bytes;
  for (int i = 0; i < 40; ++i) bytes.insert(bytes.end(), what.begin(), what.end());
  return bytes;
}

void Write(const fs::path& path, const Bytes& bytes) {
  fs::create_directories(path.parent_path());
  ASSERT_TRUE(WriteFileAtomic(path.string(), bytes).ok());
}

class SessionMaker {
 public:
  explicit SessionMaker(const fs::path& dir) : paths_{dir}, blobs_(paths_.Blobs()) {
    fs::create_directories(dir);
    for (int id = 1; id <= kNumPhotos; ++id) AddPhoto(id);
    AddMap();
    EXPECT_TRUE(WriteLedger(paths_.Ledger(), kId, facts_, {{"camera", "key", "1"}}).ok());
    EXPECT_TRUE(WriteSessionFile(paths_, kId).ok());
    AddRetrieval();
    AddResults();
    AddKeys();
    AddUpload();
  }

 private:
  std::string Blob(const std::string& what) { return *blobs_.Put(Content(what)); }

  template <class T>
  void Add(T fact, const std::string& fact_id) {
    fact.header.fact_id = fact_id;
    fact.header.session_id = kId;
    fact.header.seq = static_cast<int64_t>(facts_.size()) + 1;
    facts_.push_back(fact);
  }

  void AddPhoto(int64_t id) {
    const std::string number = std::to_string(id);
    image_t image{};
    image.image_id = id;
    image.agent = "alice";
    image.name = number + ".jpg";
    image.blob_id = HashBytes(Content("photo" + number).data(), Content("photo" + number).size());
    EXPECT_TRUE(StorePhoto(paths_, image.agent, image.name, Content("photo" + number)).ok());
    Add(image, ImageFactId(image.blob_id));
    features_t features{};
    features.image_id = id;
    features.keypoints_blob = Blob("keypoints" + number);
    features.descriptors_blob = Blob("descriptors" + number);
    Add(features, FeaturesFactId(id));
    candidates_t candidates{};
    candidates.image_id = id;
    matches_t matches{};
    matches.image_id = id;
    for (int64_t other = 1; other < id; ++other) {
      candidates.other_ids.push_back(other);
      candidates.distances.push_back(0.5F);
      two_view_t pair{};
      pair.other_id = other;
      matches.pairs.push_back(pair);
    }
    candidates.num_candidates = static_cast<int32_t>(candidates.other_ids.size());
    matches.num_pairs = static_cast<int32_t>(matches.pairs.size());
    if (id > 1) matches.pairs_blob = Blob("pairs" + number);
    Add(candidates, CandidatesFactId(id));
    Add(matches, MatchesFactId(id));
  }

  void AddMap() {
    seed_t seed{};
    seed.submap_id = 1;
    seed.image_id1 = 1;
    seed.image_id2 = 2;
    Add(seed, SeedFactId(1, 2));
    for (const char* name : {"old model", "new model"}) {
      submap_model_t model{};
      model.submap_id = 1;
      model.model_blob = Blob(name);
      Add(model, name);
    }
  }

  void AddRetrieval() {
    Bytes graph = Content("graph");
    const std::string hash = HashBytes(graph.data(), graph.size());
    graph.insert(graph.end(), hash.begin(), hash.end());
    Write(paths_.Retrieval() / "hnsw.bin", graph);
  }

  void AddResults() {
    Write(paths_.Sparse() / "0" / "points3D.bin", Content("points"));
    Write(paths_.Report(), Content("report"));
    EXPECT_TRUE(WriteChecksumList(paths_.root, "results.sha256", {"sparse", "report.json"}).ok());
  }

  void AddUpload() {
    const Bytes photo = Content("photo of a phone");
    const std::string hash = HashBytes(photo.data(), photo.size());
    Write(paths_.Uploads() / "carol" / (hash + ".photo"), photo);
  }

  void AddKeys() {
    const std::string keys = paths_.Keys().string();
    const auto ingest = OpenSessionKeys(keys, kId, Role::kIngest, "ingest");
    ASSERT_TRUE(ingest.ok()) << ingest.error();
    EXPECT_TRUE(SaveCounters(keys, {{ingest->credential.key.public_key(), 7}}).ok());
    EXPECT_TRUE(RecordInvitation(keys, "lost-phone").ok());
    EXPECT_TRUE(RevokeName(keys, "lost-phone").ok());
    EXPECT_TRUE(OpenRelayCertificate(keys).ok());
  }

  const SessionPaths paths_;
  BlobStore blobs_;
  std::vector<Fact> facts_;
};

std::vector<fs::path> FilesIn(const fs::path& dir) {
  std::vector<fs::path> files;
  for (const fs::path& file : FilesUnder(dir)) {
    if (fs::file_size(file) > 0) files.push_back(file);
  }
  return files;
}

size_t Below(size_t end, std::mt19937_64* random) {
  return std::uniform_int_distribution<size_t>(0, end - 1)(*random);
}

void Flip(const fs::path& file, size_t at, int bit) {
  Bytes bytes = *ReadFile(file.string());
  bytes[at] ^= static_cast<uint8_t>(1 << bit);
  // In place: a photo has a second name.
  std::ofstream out(file, std::ios::in | std::ios::out | std::ios::binary);
  out.write(reinterpret_cast<const char*>(bytes.data()),
            static_cast<std::streamsize>(bytes.size()));
}

// Damages the features of a photo in their row: the id and the kind stand side by side.
void FlipFeatures(const SessionPaths& paths, int64_t image_id) {
  const std::string text = FeaturesFactId(image_id) + "features";
  const Bytes bytes = *ReadFile(paths.Ledger().string());
  const auto at = std::search(bytes.begin(), bytes.end(), text.begin(), text.end());
  ASSERT_NE(at, bytes.end());
  Flip(paths.Ledger(), static_cast<size_t>(at - bytes.begin()), 0);
}

// With the hard links of the photos.
void Copy(const fs::path& from, const fs::path& to) {
  const std::string command = "cp -a '" + from.string() + "' '" + to.string() + "'";
  ASSERT_EQ(std::system(command.c_str()), 0);
}

size_t CountOf(const SessionCheck& check, Remedy remedy) {
  return static_cast<size_t>(
      std::count_if(check.findings.begin(), check.findings.end(),
                    [&](const Finding& finding) { return finding.remedy == remedy; }));
}

template <class T>
size_t NumOf(const std::vector<Fact>& facts) {
  return static_cast<size_t>(std::count_if(facts.begin(), facts.end(), [](const Fact& fact) {
    return std::holds_alternative<T>(fact);
  }));
}

class StoreTest : public testing::Test {
 protected:
  StoreTest() : folder_(InMemory()), paths_{folder_ / "session"} {
    SessionMaker maker(paths_.root);
  }

  // Where there is such a folder: a sync costs nothing there.
  static fs::path InMemory() {
    return fs::exists("/dev/shm") ? fs::path("/dev/shm") : fs::temp_directory_path();
  }

  SessionCheck Check() const { return CheckSession(paths_); }
  Repaired Repair() const {
    const Result<Repaired> repaired = RepairSession(paths_);
    EXPECT_TRUE(repaired.ok()) << repaired.error();
    return *repaired;
  }
  fs::path BlobOf(const std::string& what) const {
    const Bytes bytes = Content(what);
    return BlobStore(paths_.Blobs()).Path(HashBytes(bytes.data(), bytes.size()));
  }

  TestFolder folder_;
  const SessionPaths paths_;
};

TEST_F(StoreTest, AWholeSessionHasNoFindingsAndNeedsNoRepair) {
  const SessionCheck check = Check();
  EXPECT_TRUE(check.IsWhole());
  EXPECT_EQ(check.num_photos, size_t{kNumPhotos});
  EXPECT_EQ(check.facts.size(), size_t{4 * kNumPhotos + 3});
  EXPECT_TRUE(Repair().done.empty());
}

TEST_F(StoreTest, ADamagedFactTakesWhatRestsOnItAndLeavesTheRest) {
  FlipFeatures(paths_, 4);
  const SessionCheck before = Check();
  EXPECT_FALSE(before.IsWhole());
  Repair();
  const SessionCheck after = Check();
  EXPECT_TRUE(after.IsWhole());
  EXPECT_EQ(NumOf<image_t>(after.facts), size_t{kNumPhotos});
  EXPECT_EQ(NumOf<features_t>(after.facts), size_t{kNumPhotos - 1});
  // Photos 5 and 6 were matched with 4.
  EXPECT_EQ(NumOf<matches_t>(after.facts), 3u);
  EXPECT_EQ(NumOf<submap_model_t>(after.facts), 0u);
  EXPECT_EQ(after.ledger.notes.size(), 1u);
  EXPECT_FALSE(fs::exists(paths_.Retrieval()));
}

TEST_F(StoreTest, AGarbledPageCostsTheFactsOnIt) {
  const Bytes bytes = *ReadFile(paths_.Ledger().string());
  std::fstream file(paths_.Ledger(), std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(static_cast<std::streamoff>(bytes.size() / 2 / 4096 * 4096));
  file << std::string(4096, '\x5a');
  file.close();
  EXPECT_FALSE(Check().IsWhole());
  Repair();
  const SessionCheck after = Check();
  EXPECT_EQ(CountOf(after, Remedy::kMakeAnew), 0u);
  EXPECT_GT(after.facts.size(), 0u);
}

TEST_F(StoreTest, AnUnreadableLedgerLeavesThePhotosToBeTakenInAgain) {
  std::ofstream(paths_.Ledger()) << std::string(20000, '\x5a');
  fs::remove(paths_.SessionFile());
  Repair();
  const SessionCheck after = Check();
  EXPECT_TRUE(after.has_sound_session_file);
  EXPECT_EQ(after.facts.size(), 0u);
  EXPECT_EQ(CountOf(after, Remedy::kNone), size_t{kNumPhotos});
}

TEST_F(StoreTest, APhotoComesBackFromItsSecondCopy) {
  const fs::path photo = paths_.Image("alice", "3.jpg");
  fs::remove(photo);
  EXPECT_EQ(CountOf(Check(), Remedy::kRepair), 1u);
  EXPECT_TRUE(Repair().photos_to_send.empty());
  EXPECT_TRUE(Check().IsWhole());
  EXPECT_EQ(*ReadFile(photo.string()), Content("photo3"));
}

TEST_F(StoreTest, APhotoThatIsNowhereStaysInTheLedgerAndMustBeSentAgain) {
  Flip(paths_.Image("alice", "3.jpg"), 5, 1);
  EXPECT_EQ(CountOf(Check(), Remedy::kSendAgain), 1u);
  EXPECT_EQ(Repair().photos_to_send, std::vector<std::string>{"alice/3.jpg"});
  const SessionCheck after = Check();
  EXPECT_EQ(CountOf(after, Remedy::kSendAgain), 1u);
  EXPECT_EQ(after.findings.size(), 1u);
  EXPECT_EQ(after.facts.size(), Check().facts.size());
}

TEST_F(StoreTest, ALostBlobOfMatchesCostsTheseMatches) {
  fs::remove(BlobOf("pairs5"));
  EXPECT_EQ(CountOf(Check(), Remedy::kMakeAnew), 1u);
  Repair();
  const SessionCheck after = Check();
  EXPECT_TRUE(after.IsWhole());
  EXPECT_EQ(NumOf<matches_t>(after.facts), size_t{kNumPhotos - 1});
}

TEST_F(StoreTest, ASupersededModelIsNotMissed) {
  fs::remove(BlobOf("old model"));
  EXPECT_TRUE(Check().IsWhole());
  fs::remove(BlobOf("new model"));
  EXPECT_EQ(CountOf(Check(), Remedy::kMakeAnew), 1u);
}

TEST_F(StoreTest, TheIdComesBackFromTheLedger) {
  ASSERT_TRUE(WriteSessionFile(paths_, "fedcba9876543210").ok());
  EXPECT_EQ(CountOf(Check(), Remedy::kRepair), 1u);
  Repair();
  EXPECT_EQ(OpenSession(paths_.root)->session_id, kId);
}

TEST_F(StoreTest, DoesNotRepairBeneathAnIngest) {
  const auto ledger = Ledger::Open(paths_.Ledger());
  ASSERT_TRUE(ledger.ok());
  EXPECT_FALSE(RepairSession(paths_).ok());
  EXPECT_TRUE(Check().IsWhole());
}

TEST_F(StoreTest, ACloneIsTheSameUnderAnotherId) {
  const SessionPaths clone{folder_ / "clone"};
  const Result<Session> session = CloneSession(paths_, clone.root);
  ASSERT_TRUE(session.ok()) << session.error();
  EXPECT_NE(session->session_id, kId);
  const SessionCheck check = CheckSession(clone);
  EXPECT_TRUE(check.IsWhole());
  EXPECT_EQ(check.session_id, session->session_id);
  EXPECT_EQ(check.facts.size(), Check().facts.size());
  EXPECT_FALSE(CloneSession(paths_, clone.root).ok()) << "it exists";
  FlipFeatures(paths_, 4);
  EXPECT_FALSE(CloneSession(paths_, folder_ / "another").ok()) << "it is damaged";
}

TEST_F(StoreTest, APhotoThatWaitsForIngestIsCheckedAndCloned) {
  ASSERT_TRUE(CloneSession(paths_, folder_ / "clone").ok());
  const std::vector<fs::path> uploads = FilesIn(SessionPaths{folder_ / "clone"}.Uploads());
  ASSERT_EQ(uploads.size(), 1u);
  Flip(FilesIn(paths_.Uploads()).front(), 3, 1);
  EXPECT_EQ(CountOf(CheckSession(paths_), Remedy::kSendAgain), 1u);
  const Result<Repaired> repaired = RepairSession(paths_);
  ASSERT_TRUE(repaired.ok()) << repaired.error();
  EXPECT_EQ(repaired->photos_to_send.size(), 1u);
  EXPECT_TRUE(CheckSession(paths_).IsWhole());
}

TEST_F(StoreTest, WithoutTheListOfRevokedNamesAllKeysEnd) {
  Flip(paths_.Keys() / "revoked", 10, 3);
  const Result<Repaired> repaired = RepairSession(paths_);
  ASSERT_TRUE(repaired.ok()) << repaired.error();
  EXPECT_FALSE(fs::exists(paths_.Keys()));
  EXPECT_TRUE(fs::exists(paths_.root / "damaged" / "keys" / "root.key"));
  EXPECT_EQ(repaired->done.back(), "invitations that hang on keys/revoked have ended: invite anew");
}

// Bits of every file, seeded. Each is told, or changes nothing that is read.
class BitFlipTest : public StoreTest {
 protected:
  static bool ReadsTheSame(const SessionCheck& a, const SessionCheck& b) {
    const auto same_fact = [](const Fact& x, const Fact& y) {
      return EncodeFact(x) == EncodeFact(y);
    };
    return a.session_id == b.session_id && a.ledger.notes.size() == b.ledger.notes.size() &&
           std::equal(a.facts.begin(), a.facts.end(), b.facts.begin(), b.facts.end(), same_fact);
  }

  // Returns how many flips were told.
  int FlipAndRepair(const fs::path& original, int num_flips, uint64_t seed) {
    const SessionCheck whole = CheckSession(SessionPaths{original});
    std::mt19937_64 random(seed);
    int num_told = 0;
    for (int i = 0; i < num_flips; ++i) {
      fs::remove_all(folder_ / "copy");
      Copy(original, folder_ / "copy");
      const SessionPaths copy{folder_ / "copy"};
      const std::vector<fs::path> files = FilesIn(copy.root);
      const fs::path& file = files[Below(files.size(), &random)];
      const size_t at = Below(fs::file_size(file), &random);
      Flip(file, at, static_cast<int>(Below(8, &random)));
      const std::string where = file.string() + " at " + std::to_string(at);
      const SessionCheck check = CheckSession(copy);
      num_told += !check.IsWhole();
      EXPECT_TRUE(!check.IsWhole() || ReadsTheSame(check, whole)) << where;
      const Result<Repaired> repaired = RepairSession(copy);
      EXPECT_TRUE(repaired.ok()) << where << ": " << repaired.error();
      const SessionCheck after = CheckSession(copy);
      EXPECT_EQ(CountOf(after, Remedy::kRepair) + CountOf(after, Remedy::kMakeAnew), 0u) << where;
    }
    return num_told;
  }
};

TEST_F(BitFlipTest, AreToldAndRepaired) { EXPECT_GT(FlipAndRepair(paths_.root, 400, 1), 300); }

TEST_F(BitFlipTest, AreToldInTheLogOfALedgerThatWasNotClosed) {
  const auto ledger = Ledger::Open(paths_.Ledger());
  ASSERT_TRUE(ledger.ok());
  const SessionCheck whole = Check();
  for (int i = 0; i < 20; ++i) {
    configuration_t fact{};
    fact.header.fact_id = "configuration/" + std::to_string(i);
    fact.header.session_id = kId;
    fact.header.seq = (*ledger)->head() + 1;
    ASSERT_TRUE((*ledger)
                    ->Append({{fact.header.seq, fact.header.fact_id, FactKindName(Fact(fact)), 0,
                               EncodeFact(fact)}})
                    .ok());
  }
  Copy(paths_.root, folder_ / "killed");
  for (const fs::path& file : FilesIn(folder_ / "killed")) {
    if (file.string().find("ledger.db") == std::string::npos) fs::remove(file);
  }
  ASSERT_TRUE(fs::exists(folder_ / "killed" / "ledger.db-wal"));
  std::mt19937_64 random(2);
  const Bytes log = *ReadFile((folder_ / "killed" / "ledger.db-wal").string());
  const size_t num_facts = Ledger::Survey(folder_ / "killed" / "ledger.db").records.size();
  EXPECT_EQ(num_facts, whole.facts.size() + 20);
  for (int i = 0; i < 200; ++i) {
    fs::remove_all(folder_ / "copy");
    Copy(folder_ / "killed", folder_ / "copy");
    const size_t at = Below(log.size(), &random);
    Flip(folder_ / "copy" / "ledger.db-wal", at, static_cast<int>(Below(8, &random)));
    const SessionCheck check = CheckSession(SessionPaths{folder_ / "copy"});
    const bool told =
        std::any_of(check.findings.begin(), check.findings.end(),
                    [](const Finding& finding) { return finding.what.rfind("ledger.db", 0) == 0; });
    EXPECT_TRUE(told || check.facts.size() == num_facts) << at;
  }
}

}  // namespace skein::store_test
