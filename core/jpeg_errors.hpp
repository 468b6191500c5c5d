// What libjpeg says of a picture, kept instead of printed.
#pragma once

#include <jerror.h>
#include <jpeglib.h>

#include <algorithm>
#include <csetjmp>
#include <cstdio>

namespace tankrig {

/// For a decoder that is given up with longjmp to `give_up`: between setjmp and there, nothing may have a destructor.
struct JpegErrors {
  jpeg_error_mgr manager;
  std::jmp_buf give_up;
  bool damaged;    ///< a warning that part of the picture is made up
  int extraneous;  ///< most bytes in one place that belong to no part of the picture; a camera may pad the end with some

  void attach(jpeg_decompress_struct& decoder) {
    decoder.err = jpeg_std_error(&manager);
    manager.error_exit = [](j_common_ptr from) { std::longjmp(of(from).give_up, 1); };
    manager.emit_message = [](j_common_ptr from, int level) {
      JpegErrors& errors = of(from);
      if (level >= 0) return;  // no warning
      const int code = errors.manager.msg_code;
      if (code == JWRN_EXTRANEOUS_DATA)
        errors.extraneous = std::max(errors.extraneous, errors.manager.msg_parm.i[0]);
      else
        errors.damaged = errors.damaged || (code != JWRN_ADOBE_XFORM && code != JWRN_JFIF_MAJOR);
    };
  }

 private:
  static JpegErrors& of(j_common_ptr decoder) { return *reinterpret_cast<JpegErrors*>(decoder->err); }
};

}  // namespace tankrig
