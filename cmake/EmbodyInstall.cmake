# What `cmake --install` puts where. Included once, after all targets exist.
# The configuration belongs to the administrator: /etc/embody for the prefixes /usr and /usr/local, and an existing
# embody.toml is never overwritten. The reference copy is in share/embody.
if(CMAKE_INSTALL_PREFIX MATCHES "^/usr(/local)?/?$")
  set(EMBODY_CONFIG_DIR /etc/embody)
else()
  set(EMBODY_CONFIG_DIR ${CMAKE_INSTALL_FULL_SYSCONFDIR}/embody)
endif()
set(embody_share ${CMAKE_INSTALL_DATADIR}/embody)

foreach(program embodyd embodyctl embody-sim embody-view)
  if(TARGET ${program})
    install(TARGETS ${program} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
  endif()
endforeach()

install(DIRECTORY ${PROJECT_SOURCE_DIR}/config/ DESTINATION ${embody_share})
install(DIRECTORY ${PROJECT_SOURCE_DIR}/daemon/dds/idl DESTINATION ${embody_share})
install(CODE "
  set(config \"\$ENV{DESTDIR}${EMBODY_CONFIG_DIR}/embody.toml\")
  if(EXISTS \"\${config}\")
    message(STATUS \"Kept: \${config}\")
  else()
    file(INSTALL \"${PROJECT_SOURCE_DIR}/config/embody.toml\" DESTINATION \"${EMBODY_CONFIG_DIR}\")
  endif()")

configure_file(${PROJECT_SOURCE_DIR}/systemd/embodyd.service.in ${PROJECT_BINARY_DIR}/systemd/embodyd.service @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/systemd/embodyd.service DESTINATION lib/systemd/system)
install(FILES ${PROJECT_SOURCE_DIR}/systemd/embody.sysusers.conf DESTINATION lib/sysusers.d RENAME embody.conf)
install(FILES ${PROJECT_SOURCE_DIR}/systemd/70-embody-mia.rules DESTINATION lib/udev/rules.d)

install(FILES ${PROJECT_SOURCE_DIR}/LICENSE ${PROJECT_SOURCE_DIR}/systemd/lab-network.conf
        DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/embody)
install(PROGRAMS ${PROJECT_SOURCE_DIR}/scripts/mano-pickle-to-npz DESTINATION ${embody_share}/scripts)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/examples/dds_subscriber DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/embody/examples)
install(FILES ${PROJECT_SOURCE_DIR}/docs/man/embodyctl.1 ${PROJECT_SOURCE_DIR}/docs/man/embody-sim.1
        DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
install(FILES ${PROJECT_SOURCE_DIR}/docs/man/embodyd.8 DESTINATION ${CMAKE_INSTALL_MANDIR}/man8)
