# cmake --install build/release --prefix PREFIX
#
#   bin/skein                      a link to lib/skein/bin/skein
#   lib/skein/bin                  programs
#   lib/skein/{data,scripts,web}   codebook; launch.sh, reconstruct.sh, demo.sh, engines; the live view's page
#   share/skein/lcmtypes           the messages, for programs of other languages
#
# A program finds data, scripts and page beside the folder that holds it, in the build tree as in lib/skein.
file(CREATE_LINK ${CMAKE_SOURCE_DIR}/data ${CMAKE_BINARY_DIR}/data SYMBOLIC)
file(CREATE_LINK ${CMAKE_SOURCE_DIR}/scripts ${CMAKE_BINARY_DIR}/scripts SYMBOLIC)

set(skein_folder lib/skein)
install(TARGETS skein skein-decoder skein-ingest skein-features skein-retrieval skein-matching skein-mapper skein-merger
  skein-guide skein-dense skein-relay skein-web RUNTIME DESTINATION ${skein_folder}/bin)
install(CODE "
  set(bin \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/bin\")
  file(MAKE_DIRECTORY \"\${bin}\")
  file(CREATE_LINK ../${skein_folder}/bin/skein \"\${bin}/skein\" SYMBOLIC)")
install(FILES data/vlad_codebook.bin DESTINATION ${skein_folder}/data)
install(PROGRAMS scripts/demo.sh scripts/launch.sh scripts/reconstruct.sh scripts/service.sh scripts/worker_job.sh
  DESTINATION ${skein_folder}/scripts)
install(DIRECTORY scripts/engines DESTINATION ${skein_folder}/scripts USE_SOURCE_PERMISSIONS)
install(FILES scripts/lib.sh scripts/mapper_pool.sh DESTINATION ${skein_folder}/scripts)
install(DIRECTORY ${CMAKE_BINARY_DIR}/web DESTINATION ${skein_folder} OPTIONAL)
install(DIRECTORY lcmtypes DESTINATION share/skein FILES_MATCHING PATTERN "*.lcm")
