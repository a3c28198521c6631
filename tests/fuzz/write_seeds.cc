// write_seeds DIR: DIR/TARGET/... for each fuzz target, what it begins with: small valid encodings.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>
#include <string>
#include <utility>
#include <vector>

#include "auth/message_seal.h"
#include "auth/session_keys.h"
#include "core/file.h"
#include "core/hash.h"
#include "formats/formats.h"
#include "fuzz/message_types.h"
#include "fuzz/test_keys.h"
#include "ledger/ledger_range.h"
#include "ledger/ledger_store.h"
#include "ledger/session_folder.h"
#include "photo/decoder_wire.h"
#include "testing/test_folder.h"
#include "testing/test_photos.h"
#include "transport/invitation.h"
#include "transport/tcpq_wire.h"
#include "transport/udpm_link.h"

namespace {

using namespace skein;
namespace fs = std::filesystem;

class Seeds {
 public:
  explicit Seeds(fs::path dir) : dir_(std::move(dir)) {}

  void Add(const std::string& target, const Bytes& bytes) {
    fs::create_directories(dir_ / target);
    const std::string name = HashBytes(bytes.data(), bytes.size()).substr(0, 16);
    std::ofstream file(dir_ / target / name, std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    if (!file.flush()) throw std::runtime_error("cannot write a seed of " + target);
  }
  void AddText(const std::string& target, const std::string& text) {
    Add(target, Bytes(text.begin(), text.end()));
  }

 private:
  const fs::path dir_;
};

template <class T>
Bytes EncodeMessage(const T& message) {
  Bytes bytes(message.getEncodedSize());
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

image_t SomeImage() {
  image_t image{};
  image.header.fact_id = "image/1";
  image.header.session_id = "0123456789abcdef";
  image.header.author = "ingest";
  image.header.seq = 1;
  image.image_id = 1;
  image.agent = "alice";
  image.name = "a.jpg";
  image.width_px = 96;
  image.height_px = 80;
  image.num_camera_params = 2;
  image.camera_params = {1, 2};
  return image;
}

failure_t SomeFailure(int64_t seq) {
  failure_t failure{};
  failure.header.fact_id = "failure/" + std::to_string(seq);
  failure.header.seq = seq;
  failure.reason = "damaged";
  return failure;
}

void AddMessages(Seeds* seeds) {
  for (size_t type = 0; type < fuzz::kNumMessageTypes; ++type) {
    fuzz::WithMessageType(type, [&](auto message) {
      const Bytes encoded = EncodeMessage(message);
      Bytes bytes = {static_cast<uint8_t>(type)};
      bytes.insert(bytes.end(), encoded.begin() + 8, encoded.end());
      seeds->Add("messages", bytes);
    });
  }
}

void AddTransport(Seeds* seeds) {
  const Bytes message = EncodeMessage(SomeImage());
  Bytes stream = {3};
  tcpq::AppendGreeting(tcpq::kClientMagic, &stream);
  tcpq::AppendSubscription(tcpq::FrameType::kSubscribe, "SKEIN_IMAGE", &stream);
  tcpq::AppendPublish("SKEIN_IMAGE", message.data(), message.size(), &stream);
  tcpq::AppendSubscription(tcpq::FrameType::kUnsubscribe, "SKEIN_IMAGE", &stream);
  seeds->Add("tcpq_wire", stream);
  seeds->Add("udpm_datagram", MakeLcmDatagram(7, "SKEIN_IMAGE", message.data(), message.size()));
  for (const char* url : {"udpm://239.255.76.67:7667?ttl=1&recv_buf_size=4096", "tcpq://host:7700",
                          "memq://", "tcpq://"}) {
    seeds->AddText("lcm_url", url);
  }
}

void AddAuth(Seeds* seeds) {
  const fuzz::TestKeys keys;
  MessageSeal seal(keys.trust, keys.credential, {}, [] { return int64_t{1'000'000}; });
  seeds->Add("seal", seal.Seal("SKEIN_IMAGE_OFFER", EncodeMessage(SomeImage())));
  seeds->Add("seal", seal.Seal("SKEIN_IMAGE_OFFER", {}));
  seeds->Add("seal", EncodeCredential(keys.credential));
  for (const char* url : {"tcpq://host:7700", "udpm://239.255.76.67:7667?ttl=1"}) {
    seeds->AddText("invitation", ToLink({ParseLcmUrl(url), keys.trust, keys.credential}));
  }
}

void AddFormats(Seeds* seeds) {
  seeds->Add("keypoints", EncodeKeypoints({{1.5f, 2.5f, 3, 0.5f, 1, 2, 3}, {}}));
  seeds->Add("descriptors", EncodeDescriptors({std::vector<uint8_t>(2 * Descriptors::kDim, 7)}));
  seeds->Add("global_descriptor", EncodeGlobalDescriptor({"vlad-1", {0.5f, -0.5f}}));
  TwoViewPair pair;
  pair.other_id = 7;
  pair.inliers = {{1, 2}, {3, 4}};
  seeds->Add("two_view_pairs", EncodeTwoViewPairs({pair, TwoViewPair()}));
  seeds->Add("model_archive", EncodeModelArchive({{"cameras.bin", {1, 2, 3}}, {"state.bin", {}}}));
  SharedImage image;
  image.params = {1000, 500, 400, 0.1};
  image.points = {{3, {1, 2, 3}, 4, 5}};
  seeds->Add("shared_images", EncodeSharedImages({image}));
}

void AddPhotos(Seeds* seeds) {
  ExifBuilder exif;
  exif.Ascii(0, 0x010f, "Canon");
  exif.Ascii(0, 0x0110, "Canon EOS 5D Mark II");
  exif.Short(0, 0x0112, 6);
  exif.Rationals(1, 0x920a, {{50, 1}});
  exif.Rationals(1, 0xa20e, {{4000, 1}});
  exif.Short(1, 0xa405, 28);
  exif.Ascii(1, 0x9003, "2009:02:14 00:31:30");
  exif.Ascii(1, 0x9011, "+01:00");
  exif.Ascii(1, 0x9291, "25");
  exif.Ascii(2, 1, "S");
  exif.Rationals(2, 2, {{33, 1}, {30, 1}, {36, 1}});
  exif.Ascii(2, 3, "E");
  exif.Rationals(2, 4, {{151, 1}, {15, 1}, {0, 1}});
  Bytes progressive;
  cv::imencode(".jpg", Noise(64, 64), progressive, {cv::IMWRITE_JPEG_PROGRESSIVE, 1});
  const std::vector<Bytes> photos = {
      exif.Into(SmallJpeg(1, 64, 64)),          progressive,
      Encode(Noise(64, 64, CV_8UC1), ".jpg"),   Encode(Noise(64, 64, CV_16UC1), ".png"),
      Encode(Noise(64, 64, CV_8UC3), ".png"),   Encode(Noise(64, 64, CV_8UC4), ".png"),
      Encode(Noise(64, 64, CV_16UC3), ".tiff"), Encode(Noise(64, 64, CV_8UC1), ".tiff")};
  for (const Bytes& photo : photos) {
    for (const char* target : {"photo_header", "exif", "decoding"}) seeds->Add(target, photo);
  }
  DecoderAnswer answer;
  answer.status = DataLoss("damaged");
  answer.exif.make = "make";
  answer.exif.gps = GpsPosition{1, 2, 3, 4};
  seeds->Add("decoder_wire", EncodeDecoderAnswer(answer));
  seeds->Add("decoder_wire", EncodeDecoderRequest({}));
}

void AddLedger(Seeds* seeds) {
  const TestFolder folder;
  LedgerRangeWriter range;
  std::vector<LedgerRecord> records;
  for (const Fact& fact : {Fact(SomeImage()), Fact(SomeFailure(2))}) {
    const Bytes bytes = EncodeFact(fact);
    range.Add(FactKind(fact), bytes.data(), bytes.size());
    records.push_back({Header(fact).seq, Header(fact).fact_id, FactKindName(fact), 1, bytes});
  }
  seeds->Add("ledger_range", range.Take());
  {
    auto ledger = Ledger::Open(folder / "ledger.db");
    if (!ledger.ok()) throw std::runtime_error(ledger.error());
    if (Status status = (*ledger)->Append(records, {{"camera", "key", "1"}}); !status.ok()) {
      throw std::runtime_error(status.error());
    }
  }  // closing it moves the write-ahead log into the file
  seeds->Add("ledger_file", *ReadFile((folder / "ledger.db").string()));
  if (!WriteSessionFile({folder.path()}, "0123456789abcdef").ok())
    throw std::runtime_error("session");
  seeds->Add("session_json", *ReadFile((folder / "session.json").string()));
}

void AddTexts(Seeds* seeds) {
  seeds->AddText("config_file",
                 "# options\n[features]\nmax_features = 8192\nglobal_mean = [0.4, 0.5, 0.6]\n"
                 "[[cameras]]\nagent = \"alice\"\n[[cameras]]\nbody = 'DJI*'\n");
  const std::string hash = HashBytes("x", 1);
  seeds->AddText("checksum_list", hash + "  a\n" + hash + "  b/c\n");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: write_seeds DIR\n");
    return 2;
  }
  Seeds seeds(argv[1]);
  AddMessages(&seeds);
  AddTransport(&seeds);
  AddAuth(&seeds);
  AddFormats(&seeds);
  AddPhotos(&seeds);
  AddLedger(&seeds);
  AddTexts(&seeds);
  return 0;
}
