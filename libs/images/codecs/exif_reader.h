#pragma once

#include "photo/byte_view.h"
#include "photo/exif.h"
#include "photo/photo_header.h"

namespace skein {

// Reads the EXIF block of a JPEG (APP1), PNG (eXIf) or TIFF. Without one, everything is unset.
//
// Focal length in pixels, the first that is there:
//  - FocalLengthIn35mmFilm by the diagonal (CIPA DCG-001): f35 * diagonal / 43.27 mm. The result
//    equals f35 * width / 36 for a 3:2 sensor. For 4:3 it is closer (south-building: 1,294 px, by
//    width 1,244, calibrated 1,333).
//  - FocalLength with FocalPlaneXResolution, for the width by PixelXDimension.
//  - FocalLength with the sensor's width from COLMAP's camera database.
//
// The position is EXIF's, else that of a DJI drone's XMP packet (codecs/xmp_reader.h); so is the
// altitude. The relative altitude is XMP's. Whatever neither tells is unset.
//
// Digital zoom (DigitalZoomRatio) is an enlarged crop. FocalLength does not count it. Some cameras
// count it in FocalLengthIn35mmFilm, others do not: FocalLength and the sensor's width decide.
// If the width is not known, the zoom is taken as counted, as phones do, and the focal length is a
// guess.
//
// A photo whose shape is not that of PixelXDimension and PixelYDimension was cropped. If one side
// is as long as in EXIF the crop was not scaled. Otherwise the smallest crop is taken, and the
// focal length is a guess.
Exif ReadExif(ByteView bytes, const PhotoHeader& header);

// Its orientation alone, 1..8; 1 without one.
int ReadOrientation(ByteView bytes, PhotoFormat format);

}  // namespace skein
