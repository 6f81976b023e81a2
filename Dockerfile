# A small image with one static binary: no shell, no package manager, not root.
FROM rust:1-slim-bookworm AS build
WORKDIR /build
COPY Cargo.toml Cargo.lock ./
COPY build.rs ./
COPY src src
COPY benches benches
COPY examples examples
COPY LICENSE ./
# Linking libc statically needs the target to be named, whichever it is.
RUN target="$(rustc -vV | sed -n 's/host: //p')" \
    && RUSTFLAGS="-C target-feature=+crt-static" \
       cargo build --release --locked --bin kreisel --target "$target" \
    && cp "target/$target/release/kreisel" /kreisel
# The licences of all that is linked into it, of the standard library too.
RUN set -- "${CARGO_HOME:-$HOME/.cargo}"/registry/src/*/*/ "$(rustc --print sysroot)/share/doc/rust/" \
    && install -D -m 644 LICENSE /licences/kreisel/LICENSE \
    && for crate do \
         for text in "$crate"LICEN* "$crate"COPYING* "$crate"COPYRIGHT "$crate"COPYRIGHT-library* "$crate"NOTICE*; do \
           [ ! -f "$text" ] || install -D -m 644 "$text" "/licences/$(basename "$crate")/$(basename "$text")"; \
         done; \
       done

FROM scratch
COPY --from=build /kreisel /kreisel
COPY --from=build /licences /licences
USER 65532:65532
HEALTHCHECK --interval=5s --timeout=3s --start-period=5s --retries=3 CMD ["/kreisel", "health"]
ENTRYPOINT ["/kreisel"]
CMD ["--help"]
