#include "formats/formats.h"

#include <stdexcept>

#include "formats/encoding.h"

namespace skein {
namespace {

using namespace encoding;

constexpr char kKeypoints[] = "SKKP";
constexpr char kDescriptors[] = "SKDS";
constexpr char kGlobalDescriptor[] = "SKGD";
constexpr char kTwoViewPairs[] = "SKTV";
constexpr char kModelArchive[] = "SKMA";
constexpr char kSharedImages[] = "SKSI";

constexpr size_t kKeypointBytes = 4 * sizeof(float) + 3;

bool GetKeypoint(ByteReader* reader, Keypoint* k) {
  return reader->Get(&k->x) && reader->Get(&k->y) && reader->Get(&k->scale_px) &&
         reader->Get(&k->angle_rad) && reader->Get(&k->r) && reader->Get(&k->g) &&
         reader->Get(&k->b);
}

constexpr size_t kMinPairBytes = 8 + 1 + (27 + 7) * sizeof(double) + 2 * sizeof(float) + 4;

void PutPair(ByteWriter* writer, const TwoViewPair& pair) {
  writer->Put(pair.other_id);
  writer->Put(pair.geometry);
  for (const auto* matrix : {&pair.E, &pair.F, &pair.H}) PutArray(writer, *matrix);
  PutArray(writer, pair.qvec);
  PutArray(writer, pair.tvec);
  writer->Put(pair.tri_angle_rad);
  writer->Put(pair.forward_motion);
  writer->Put(static_cast<uint32_t>(pair.inliers.size()));
  for (const auto& [index, other_index] : pair.inliers) {
    writer->Put(index);
    writer->Put(other_index);
  }
}

bool GetPair(ByteReader* reader, TwoViewPair* pair) {
  return reader->Get(&pair->other_id) && reader->Get(&pair->geometry) &&
         GetArray(reader, &pair->E) && GetArray(reader, &pair->F) && GetArray(reader, &pair->H) &&
         GetArray(reader, &pair->qvec) && GetArray(reader, &pair->tvec) &&
         reader->Get(&pair->tri_angle_rad) && reader->Get(&pair->forward_motion) &&
         GetVector(reader, 8, &pair->inliers, [](ByteReader* in, auto* inlier) {
           return in->Get(&inlier->first) && in->Get(&inlier->second);
         });
}

constexpr size_t kSharedPointBytes = 4 + 3 * sizeof(double) + 2 * sizeof(float);
constexpr size_t kMinSharedImageBytes = 8 + 4 + 4 + 16 + 7 * sizeof(double) + 4;

void PutSharedImage(ByteWriter* writer, const SharedImage& image) {
  writer->Put(image.image_id);
  writer->Put(image.camera_model_id);
  writer->Put(static_cast<uint32_t>(image.params.size()));
  for (const double param : image.params) writer->Put(param);
  writer->Put(image.width);
  writer->Put(image.height);
  PutArray(writer, image.qvec);
  PutArray(writer, image.tvec);
  writer->Put(static_cast<uint32_t>(image.points.size()));
  for (const SharedPoint& point : image.points) {
    writer->Put(point.point2D_idx);
    PutArray(writer, point.xyz);
    writer->Put(point.u);
    writer->Put(point.v);
  }
}

bool GetSharedImage(ByteReader* reader, SharedImage* image) {
  return reader->Get(&image->image_id) && reader->Get(&image->camera_model_id) &&
         GetVector(reader, sizeof(double), &image->params,
                   [](ByteReader* in, double* param) { return in->Get(param); }) &&
         reader->Get(&image->width) && reader->Get(&image->height) &&
         GetArray(reader, &image->qvec) && GetArray(reader, &image->tvec) &&
         GetVector(reader, kSharedPointBytes, &image->points, [](ByteReader* in, SharedPoint* p) {
           return in->Get(&p->point2D_idx) && GetArray(in, &p->xyz) && in->Get(&p->u) &&
                  in->Get(&p->v);
         });
}

}  // namespace

Bytes EncodeKeypoints(const Keypoints& keypoints) {
  ByteWriter writer = Begin(kKeypoints);
  writer.Put(static_cast<uint32_t>(keypoints.size()));
  for (const Keypoint& k : keypoints) {
    for (const float value : {k.x, k.y, k.scale_px, k.angle_rad}) writer.Put(value);
    for (const uint8_t value : {k.r, k.g, k.b}) writer.Put(value);
  }
  return writer.Take();
}

Result<Keypoints> DecodeKeypoints(const Bytes& bytes) {
  return DecodeAll<Keypoints>(bytes, kKeypoints, [](ByteReader* reader, Keypoints* keypoints) {
    return GetVector(reader, kKeypointBytes, keypoints, GetKeypoint);
  });
}

Bytes EncodeDescriptors(const Descriptors& descriptors) {
  if (descriptors.data.size() % Descriptors::kDim != 0) {
    throw std::invalid_argument("descriptors: size is no multiple of 128");
  }
  ByteWriter writer = Begin(kDescriptors);
  writer.Put(static_cast<uint32_t>(descriptors.rows()));
  writer.PutRaw(descriptors.data.data(), descriptors.data.size());
  return writer.Take();
}

Result<Descriptors> DecodeDescriptors(const Bytes& bytes) {
  return DecodeAll<Descriptors>(bytes, kDescriptors, [](ByteReader* reader, Descriptors* value) {
    uint32_t rows = 0;
    if (!GetCount(reader, Descriptors::kDim, &rows)) return false;
    value->data.resize(rows * Descriptors::kDim);
    return reader->GetRaw(value->data.data(), value->data.size());
  });
}

Bytes EncodeGlobalDescriptor(const GlobalDescriptor& descriptor) {
  ByteWriter writer = Begin(kGlobalDescriptor);
  writer.PutString(descriptor.model);
  writer.Put(static_cast<uint32_t>(descriptor.values.size()));
  writer.PutRaw(descriptor.values.data(), descriptor.values.size() * sizeof(float));
  return writer.Take();
}

Result<GlobalDescriptor> DecodeGlobalDescriptor(const Bytes& bytes) {
  return DecodeAll<GlobalDescriptor>(
      bytes, kGlobalDescriptor, [](ByteReader* reader, GlobalDescriptor* value) {
        uint32_t count = 0;
        if (!reader->GetString(&value->model)) return false;
        if (!GetCount(reader, sizeof(float), &count)) return false;
        if (count > kMaxGlobalDescriptorValues) return false;
        value->values.resize(count);
        return reader->GetRaw(value->values.data(), count * sizeof(float));
      });
}

Bytes EncodeTwoViewPairs(const TwoViewPairs& pairs) {
  ByteWriter writer = Begin(kTwoViewPairs);
  writer.Put(static_cast<uint32_t>(pairs.size()));
  for (const TwoViewPair& pair : pairs) PutPair(&writer, pair);
  return writer.Take();
}

Result<TwoViewPairs> DecodeTwoViewPairs(const Bytes& bytes) {
  return DecodeAll<TwoViewPairs>(bytes, kTwoViewPairs, [](ByteReader* reader, TwoViewPairs* pairs) {
    return GetVector(reader, kMinPairBytes, pairs, GetPair);
  });
}

Bytes EncodeModelArchive(const ModelArchive& archive) {
  ByteWriter writer = Begin(kModelArchive);
  writer.Put(static_cast<uint32_t>(archive.size()));
  for (const auto& [name, content] : archive) {
    writer.PutString(name);
    writer.PutBytes(content);
  }
  return writer.Take();
}

Result<ModelArchive> DecodeModelArchive(const Bytes& bytes) {
  return DecodeAll<ModelArchive>(bytes, kModelArchive, [](ByteReader* reader, ModelArchive* value) {
    uint32_t count = 0;
    if (!GetCount(reader, 4 + 8, &count)) return false;
    for (uint32_t i = 0; i < count; ++i) {
      std::string name;
      Bytes content;
      if (!reader->GetString(&name) || !reader->GetBytes(&content)) return false;
      if (!value->empty() && name <= value->rbegin()->first) return false;
      value->emplace_hint(value->end(), std::move(name), std::move(content));
    }
    return true;
  });
}

Bytes EncodeSharedImages(const SharedImages& images) {
  ByteWriter writer = Begin(kSharedImages);
  writer.Put(static_cast<uint32_t>(images.size()));
  for (const SharedImage& image : images) PutSharedImage(&writer, image);
  return writer.Take();
}

Result<SharedImages> DecodeSharedImages(const Bytes& bytes) {
  return DecodeAll<SharedImages>(bytes, kSharedImages, [](ByteReader* reader, SharedImages* value) {
    return GetVector(reader, kMinSharedImageBytes, value, GetSharedImage);
  });
}

}  // namespace skein
