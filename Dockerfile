# The harness with the tested versions of all libraries and a torch without GPU.
#   docker build -t harness .
#   docker run --rm -u "$(id -u):$(id -g)" -v "$PWD:/work" harness demo
FROM python:3.12-slim-bookworm

# Loaded by libsumo. Their versions are those of the image's Debian.
# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install --yes --no-install-recommends libatomic1 libgl1 libx11-6 libxext6 libxrender1 \
    && rm -rf /var/lib/apt/lists/*

COPY . /source
RUN pip install --no-cache-dir --extra-index-url https://download.pytorch.org/whl/cpu \
        --constraint /source/requirements.lock '/source[training]' \
    && mkdir --mode=1777 /cache

# Compiled loops and merged nets: any user of the container may write them.
ENV XDG_CACHE_HOME=/cache
WORKDIR /work
ENTRYPOINT ["harness"]
CMD ["--help"]
