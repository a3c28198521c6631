#include "mapper/model_writer.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "core/log.h"
#include "core/snapshot.h"
#include "ledger/fact_ids.h"
#include "mapper/messages.h"
#include "mapping/checkpoint.h"
#include "session/submap_steps.h"

namespace skein {

ModelWriter::ModelWriter(BlobClient& blobs, SubmapWorker& worker, WorkerThread& writer,
                         const Lease& lease, const CheckpointPace& pace, Clock clock,
                         SubmitModel submit)
    : blobs_(blobs),
      worker_(worker),
      writer_(writer),
      lease_(lease),
      pace_(pace),
      clock_(std::move(clock)),
      submit_(std::move(submit)),
      last_checkpoint_s_(clock_()) {}

std::optional<ModelWriter::Kind> ModelWriter::Due(int num_images, bool all_decided) const {
  if (under_way_) return std::nullopt;
  const double now_s = clock_();
  if (all_decided && now_s >= final_due_s_) return Kind::kFinal;
  if (num_changes_ == 0 || AwaitsFinal()) return std::nullopt;
  const bool many = num_changes_ >= std::max(pace_.photos, num_images / 10);
  if (many || now_s - last_checkpoint_s_ >= pace_.period_s) return Kind::kCheckpoint;
  return std::nullopt;
}

void ModelWriter::Write(Kind kind, const ItemCursor& done, int num_images,
                        const SubmapStatistics& statistics,
                        std::optional<ModelAssessment> assessment, OnEncoded encoded) {
  struct Encoding {
    Reader read;
    std::optional<SubmapStatistics> statistics;
  };
  const bool final = kind == Kind::kFinal;
  under_way_ =
      Model{kind, done.seq(), done.merge_seq(), num_images, statistics, std::move(assessment)};
  num_changes_ = 0;
  last_checkpoint_s_ = clock_();
  if (final) final_due_s_ = HUGE_VAL;
  worker_.Run(
      ModelStep(),
      [final](Submap& submap) {
        Encoding encoding;
        if (final) encoding.statistics = submap.Statistics();
        encoding.read = StartEncoding(&submap, !final);
        return encoding;
      },
      [this, encoded = std::move(encoded)](const Encoding& encoding) {
        if (encoding.statistics) under_way_->statistics = *encoding.statistics;
        Store(encoding.read);
        encoded(encoding.statistics);
      });
}

// In a child process of a copy of the memory, where there can be one.
ModelWriter::Reader ModelWriter::StartEncoding(Submap* submap, bool in_child) {
  if (in_child) {
    const Result<std::shared_ptr<Snapshot>> snapshot =
        Snapshot::Take([submap] { return EncodeModelArchive(SaveSubmap(submap)); });
    if (snapshot.ok()) return [taken = *snapshot] { return taken->Read(); };
    LogWarn("{}; the mapper waits for its checkpoint", snapshot.error());
  }
  auto archive = std::make_shared<const ModelArchive>(SaveSubmap(submap));
  return [archive]() -> Result<Bytes> { return EncodeModelArchive(*archive); };
}

void ModelWriter::Store(const Reader& read) {
  worker_.RunOn(
      writer_, kWriterSlot, ModelStep(),
      [read, &blobs = blobs_]() -> std::string {
        Result<Bytes> bytes = read();
        if (bytes.ok()) return blobs.Offer(std::move(*bytes));
        LogError("checkpoint: {}", bytes.error());
        return "";
      },
      [this](const std::string& blob) { OnStored(blob); });
}

void ModelWriter::OnStored(const std::string& blob) {
  const Model model = *std::exchange(under_way_, std::nullopt);
  if (blob.empty()) return TryAgain(model.kind);
  submit_(MakeFact(model, blob), [this, kind = model.kind](const std::string&) { TryAgain(kind); });
}

submap_model_t ModelWriter::MakeFact(const Model& model, const std::string& blob) {
  submap_model_t fact{};
  SetFigures(model.statistics, &fact);
  fact.check = ToMessage(model.statistics.check);
  if (model.assessment) {
    SetCompleteness(model.assessment->place, model.assessment->metres_per_unit, &fact.place);
    fact.georeference = GeoreferenceOf(*model.assessment);
  }
  fact.num_images = model.num_images;
  fact.submap_id = lease_.submap_id;
  fact.epoch = lease_.epoch;
  fact.kind = model.kind == Kind::kFinal ? submap_model_t::FINAL : submap_model_t::CHECKPOINT;
  fact.model_blob = blob;
  fact.ledger_seq = model.ledger_seq;
  fact.merge_seq = model.merge_seq;
  fact.header.fact_id = SubmapModelFactId(lease_.submap_id, lease_.epoch, ++last_number_);
  return fact;
}

// When the period has passed.
void ModelWriter::TryAgain(Kind kind) {
  ++num_changes_;
  if (kind == Kind::kFinal) final_due_s_ = clock_() + pace_.period_s;
}

}  // namespace skein
